//! Properties of each processor that images are built for.

use remora_host::choice::Choice;

/// How bytes of a word lie in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// The low byte first.
    Little,
    /// The high byte first.
    Big,
}

/// A bare-metal target with the board that QEMU emulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// The compiler's name of it.
    pub name: &'static str,
    /// The processor it is compiled for.
    pub cpu: &'static str,
    /// Clock rate for the estimate of milliseconds [Hz].
    pub clock_hz: Option<u64>,
    /// Its linker, with the Debian package that has it.
    pub linker: Package,
    /// The emulator, with the Debian package that has it.
    pub emulator: Package,
    /// The emulator's arguments for the board.
    pub board: &'static [&'static str],
    /// How the board's memory holds a word.
    pub byte_order: ByteOrder,
    /// Whether its memories are small, so that bars of image and stack hold.
    pub is_small: bool,
    /// Whether the audit has pages of its image: whether `image-audit` understands its code.
    pub is_audited: bool,
}

/// A program and the Debian package that has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Package {
    /// The program.
    pub program: &'static str,
    /// The package.
    pub package: &'static str,
}

const LLD: Package = Package { program: "lld", package: "lld" };

/// All of them.
pub static TARGETS: [Target; 4] = [
    Target {
        name: "thumbv7em-none-eabihf",
        cpu: "cortex-m7",
        clock_hz: Some(300_000_000),
        linker: LLD,
        emulator: Package { program: "qemu-system-arm", package: "qemu-system-arm" },
        board: &["-M", "mps2-an500", "-semihosting-config", "enable=on,target=native"],
        byte_order: ByteOrder::Little,
        is_small: true,
        is_audited: true,
    },
    Target {
        name: "aarch64-unknown-none",
        cpu: "cortex-a53",
        clock_hz: Some(1_200_000_000),
        linker: LLD,
        emulator: Package { program: "qemu-system-aarch64", package: "qemu-system-arm" },
        // Without `-nic none` the emulator looks for the firmware of a network card.
        board: &[
            "-M",
            "virt",
            "-cpu",
            "cortex-a53",
            "-nic",
            "none",
            "-semihosting-config",
            "enable=on,target=native",
        ],
        byte_order: ByteOrder::Little,
        is_small: false,
        is_audited: true,
    },
    Target {
        name: "riscv64gc-unknown-none-elf",
        cpu: "generic-rv64",
        clock_hz: None,
        linker: LLD,
        emulator: Package { program: "qemu-system-riscv64", package: "qemu-system-misc" },
        board: &["-M", "virt", "-bios", "none"],
        byte_order: ByteOrder::Little,
        is_small: false,
        is_audited: true,
    },
    Target {
        name: "sparc-unknown-none-elf",
        cpu: "leon3",
        clock_hz: None,
        linker: Package { program: "sparc64-linux-gnu-ld", package: "binutils-sparc64-linux-gnu" },
        emulator: Package { program: "qemu-system-sparc", package: "qemu-system-sparc" },
        board: &["-M", "leon3_generic"],
        byte_order: ByteOrder::Big,
        is_small: false,
        is_audited: false,
    },
];

/// The program for the machine that this runs on, whose plans the images' are held against.
pub const HOST: &str = "host";

impl Choice for &'static Target {
    const ALL: &'static [Self] = &[&TARGETS[0], &TARGETS[1], &TARGETS[2], &TARGETS[3]];

    fn name(self) -> &'static str {
        self.name
    }

    fn help(self) -> &'static str {
        self.cpu
    }
}

impl Target {
    /// Those that the audit has pages of.
    pub fn audited() -> impl Iterator<Item = &'static Self> {
        TARGETS.iter().filter(|target| target.is_audited)
    }

    /// The word that makes the board's memory hold `word`: the emulator writes the low byte first.
    pub fn loaded(&self, word: u32) -> u32 {
        match self.byte_order {
            ByteOrder::Little => word,
            ByteOrder::Big => word.swap_bytes(),
        }
    }
}
