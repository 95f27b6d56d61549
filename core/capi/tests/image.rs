//! The image in C for a Cortex-M7: built, run under QEMU, and held to the host and to the golden checksums.

mod common;

use common::{Public, golden, link, output, prefix, public_scenarios, root};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Scenarios that the image knows.
const SCENARIOS: usize = 12;

fn folder() -> PathBuf {
    root().join("docs/examples/c/m7")
}

/// The first public scenarios in C.
fn header(scenarios: &[Public]) -> String {
    let list =
        |numbers: &[f64]| numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", ");
    let mut text = String::from(
        "/* The first scenarios of fixtures/scenarios/public.scenarios.json, attitudes normalised; made of that \
         file by a\n * test: core/capi/tests/image.rs. */\n\
         static const struct {\n    const char *id;\n    double attitude[4], rate[3], position[3], \
         velocity[3];\n} SCENARIOS[] = {\n",
    );
    for (id, x) in scenarios {
        let (attitude, rate) = (list(&x[..4]), list(&x[4..7]));
        let (position, velocity) = (list(&x[7..10]), list(&x[10..]));
        writeln!(
            text,
            "    {{\"{id}\",\n     {{{attitude}}},\n     {{{rate}}},\n     {{{position}}},\n     {{{velocity}}}}},"
        )
        .unwrap();
    }
    text + "};\n"
}

#[test]
fn the_scenarios_are_the_first_public_ones() {
    let made = header(&public_scenarios()[..SCENARIOS]);
    let file = folder().join("scenarios.h");
    if std::env::var_os("REMORA_WRITE_SCENARIOS").is_some() {
        std::fs::write(&file, &made).unwrap();
    }
    let kept = std::fs::read_to_string(&file).unwrap();
    assert!(kept == made, "scenarios.h is stale: REMORA_WRITE_SCENARIOS=1 writes it");
}

/// Compiles the image with a board, for scenarios from one to before another.
fn compile(
    compiler: &mut Command,
    installed: &Path,
    board: &Path,
    range: (usize, usize),
) -> PathBuf {
    let (first, last) = range;
    compiler.args(["-std=c99", "-O2", "-pedantic", "-Wall", "-Wextra", "-Werror"]);
    compiler.args([format!("-DFIRST={first}"), format!("-DLAST={last}")]).arg("-I").arg(folder());
    compiler.arg(format!("-Wa,-I,{}", root().join("fixtures/models").display()));
    compiler.args([folder().join("image.c"), folder().join("models.S")]).arg(board);
    link(compiler, installed, installed.join(format!("image-{first}-{last}.elf")))
}

/// What the host prints.
fn on_host(range: (usize, usize)) -> String {
    let board = root().join("core/capi/tests/host_board.c");
    output(&mut Command::new(compile(&mut Command::new("cc"), prefix(), &board, range)))
}

/// What the image prints in the emulator.
fn on_m7(installed: &Path, range: (usize, usize)) -> String {
    let mut compiler = Command::new("arm-none-eabi-gcc");
    compiler.args(["-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-ffreestanding"]);
    compiler.args(["-nostdlib", "-fno-tree-loop-distribute-patterns", "-Wa,--noexecstack"]);
    compiler.arg("-Wl,--gc-sections").arg("-T").arg(folder().join("image.ld"));
    let image = compile(&mut compiler, installed, &folder().join("start.c"), range);
    let mut emulator = Command::new("qemu-system-arm");
    emulator.args(["-M", "mps2-an500", "-display", "none", "-monitor", "none"]);
    emulator.args(["-serial", "stdio", "-semihosting-config", "enable=on,target=native"]);
    output(emulator.arg("-kernel").arg(image))
}

/// The lines that the plans of the first scenarios must print.
fn expected(count: usize) -> Vec<String> {
    let all = public_scenarios().into_iter().zip(golden()).take(count);
    all.flat_map(|((id, _), row)| {
        [("euler heuristic", 0), ("euler model", 1), ("rk4 heuristic", 4), ("rk4 model", 5)]
            .map(|(how, column)| format!("{id} {how} {}", row[column]))
    })
    .collect()
}

/// `REMORA_IMAGE_SCENARIOS` says how many of the twelve; halves are planned at the same time.
// Verifies REM-DOR-002.
#[test]
#[ignore = "needs a compiler and an emulator for the Cortex-M7: ci/c.sh"]
fn the_image_in_c_plans_guides_and_plans_again_with_the_bits_of_the_host() {
    let installed = tempfile::tempdir().unwrap();
    let mut install = Command::new(root().join("ci/install-c.sh"));
    output(install.arg(installed.path()).arg("thumbv7em-none-eabihf"));
    let count = std::env::var("REMORA_IMAGE_SCENARIOS").map_or(1, |n| n.parse().expect("a number"));
    assert!((1..=SCENARIOS).contains(&count), "{count} scenarios of {SCENARIOS}");
    let run = |range| {
        let host = on_host(range);
        let started = std::time::Instant::now();
        let found = on_m7(installed.path(), range);
        println!("scenarios {range:?}: {:.0} s\n{found}", started.elapsed().as_secs_f64());
        assert_eq!(found, host, "M7 and host differ");
        found
    };
    let halves = [(0, count / 2), (count / 2, count)];
    let texts: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = halves
            .into_iter()
            .filter(|(first, last)| first < last)
            .map(|range| scope.spawn(move || run(range)))
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for text in &texts {
        assert_eq!(text.lines().filter(|line| line.starts_with("guide ")).count(), 20, "{text}");
        assert_eq!(text.lines().filter(|line| line.starts_with("replan ")).count(), 1, "{text}");
        assert!(text.lines().all(|line| line.len() < 60 && !line.contains(':')), "{text}");
    }
    let plans = texts.iter().flat_map(|text| text.lines().filter(|line| line.starts_with("pub-")));
    assert_eq!(plans.collect::<Vec<_>>(), expected(count));
}
