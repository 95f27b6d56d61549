//! The doors of Remora, and their names.

use crate::audit::firmware::Target;
use remora_host::choice::Choice;

/// A way to have a plan made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Door {
    /// This program, in its own process.
    Program,
    /// The archive for C.
    C,
    /// The Python package.
    Python,
    /// The archive for C as WebAssembly, under node.
    Node,
    /// An image for the processor of this number in [`Target`]'s list, under QEMU.
    Processor(usize),
}

impl Choice for Door {
    const ALL: &'static [Self] = &[
        Self::Program,
        Self::C,
        Self::Python,
        Self::Node,
        Self::Processor(0),
        Self::Processor(1),
        Self::Processor(2),
        Self::Processor(3),
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Program => "program",
            Self::C => "c",
            Self::Python => "python",
            Self::Node => "node",
            Self::Processor(index) => match <&Target>::ALL[index].cpu {
                "generic-rv64" => "riscv64",
                cpu => cpu,
            },
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Program => "This program",
            Self::C => "The archive for C",
            Self::Python => "The Python package, of the python3 on the path",
            Self::Node => "The archive for C as WebAssembly, under node",
            Self::Processor(_) => "An image for this processor, under QEMU",
        }
    }
}

impl Door {
    /// Whether it plans for arms of any number of joints, and with any solver.
    pub fn is_general(self) -> bool {
        matches!(self, Self::Program | Self::Python)
    }
}
