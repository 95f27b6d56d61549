#!/usr/bin/env python3
"""Flips one bit in a register or on the stack of the planner's image while it plans, under QEMU.

    ci/upsets.py                                  # 100 cases on the Cortex-M7
    ci/upsets.py --target aarch64-unknown-none --cases 1000 --out runs/upsets.csv
    ci/upsets.py --start model                    # from the learned start: fewer iterations
    ci/upsets.py --seed 1 --case 17               # one case again
    ci/upsets.py --ends                           # does an image end where its stack is lost, or in a loop?

The image (of `cargo xtask firmware`, in target/firmware) plans two scenarios with Euler, scrubbing as
`remora plan --scrub` does, and accepts a plan whose record is of its input and has the residuals that a second run of
the verifier finds. In one of the iterations of its QP solver, some instructions after the next call of one of its
functions, QEMU's gdb stub changes a bit; then it goes on. A case is a function of image, start, seed and number. Exit
status: 0 where no case was wrong, 1 where some were, 2 for bad input.

With --ends it runs two cases that it makes itself, in time that goes faster: the stack pointer is sent out of memory,
and a function becomes a loop without an end. Exit status 1 where one of them does not end in the fault handler.

Classes, of the plan that was struck:
  same       every line of both plans is that of the run without a fault
  tolerated  accepted by the image: another plan, and the image's own verifier, run again, finds the same residuals
  failed     not solved, refused, or not accepted, and said so
  trapped    the processor's fault handler ended the program, or the watchdog: a flight computer restarts
  hung       it did not end: not within ten times the emulator's processor time without a fault, nor within 80 s
  wrong      accepted, and solved or verified, and the residuals are others when they are computed again; or the plan
             after it is another than without a fault
"""

import argparse
import csv
import math
import os
import random
import re
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# What each iteration of the QP solver calls once.
ITERATION = "riccati9factorise"
# Instructions after a call.
STEPS = 200
# Words of the stack above its pointer that may be struck.
WORDS = 256
# Scenarios 0 and 1 with Euler, scrubbing, by where they start from: docs/guides/bare-metal.md.
REQUESTS = {"heuristic": 0x52_04_0003, "model": 0x52_06_0003}
# The least time for a case to end [s]: the watchdog's, and some.
LEAST_LONGEST = 80
SOLVED = "0"
# What the fault handler ends with.
FAULT = 102
# By --ends: an instruction takes 2^7 ns of the emulator's time, so that the watchdog's is some seconds of ours.
FAST = ["-icount", "shift=7"]

TARGETS = {
    "thumbv7em-none-eabihf": {
        "qemu": ["qemu-system-arm", "-M", "mps2-an500", "-semihosting-config", "enable=on,target=native"],
        # By the stub's numbers: r0 to r12, the stack pointer, the link register; d0 to d15.
        "registers": [*range(15), *range(26, 42)],
        "pointer": 13,
        "counter": 15,
        "bytes": 4,
        "loop": "fee7",
    },
    "aarch64-unknown-none": {
        "qemu": ["qemu-system-aarch64", "-M", "virt", "-cpu", "cortex-a53", "-nic", "none",
                 "-semihosting-config", "enable=on,target=native"],
        # x0 to x30, the stack pointer; v0 to v31.
        "registers": [*range(32), *range(34, 66)],
        "pointer": 31,
        "counter": 32,
        "bytes": 8,
        "loop": "00000014",
    },
    "riscv64gc-unknown-none-elf": {
        "qemu": ["qemu-system-riscv64", "-M", "virt", "-bios", "none"],
        # x1 to x31; f0 to f31.
        "registers": [*range(1, 32), *range(33, 65)],
        "pointer": 2,
        "counter": 32,
        "bytes": 8,
        "loop": "6f000000",
    },
    "sparc-unknown-none-elf": {
        "qemu": ["qemu-system-sparc", "-M", "leon3_generic"],
        # g1 to g7 and the window's; f0 to f31. This stub reads and writes all or none.
        "registers": range(1, 64),
        "all": True,
        "pointer": 14,
        "counter": 68,
        "bytes": 4,
        "order": "big",
        "loop": "1080000001000000",
        # The emulator ends with 0, whatever the image ended for.
        "fault": 0,
    },
}


class Stub:
    """QEMU's gdb stub."""

    def __init__(self, path):
        for _ in range(3000):
            try:
                self.socket = socket.socket(socket.AF_UNIX)
                self.socket.connect(path)
                break
            except OSError:
                time.sleep(0.01)
        self.left = b""

    def write(self, data):
        try:
            self.socket.sendall(data)
        except OSError:
            pass  # The program has ended, as the next answer will say.

    def send(self, text):
        body = text.encode()
        self.write(b"$%s#%02x" % (body, sum(body) % 256))

    def answer(self):
        """The next answer; none where the program has ended."""
        while True:
            found = re.search(rb"\$([^#]*)#..", self.left, re.DOTALL)
            if found:
                self.left = self.left[found.end():]
                self.write(b"+")
                return found[1].decode("latin1")
            try:
                more = self.socket.recv(65536)
            except OSError:
                more = b""
            if not more:
                return None
            self.left += more

    def ask(self, text):
        self.send(text)
        return self.answer()


class Image:
    """An image, its functions, and how it runs without a fault."""

    def __init__(self, file, target, start):
        self.file, self.target = file, TARGETS[target]
        self.order = self.target.get("order", "little")
        # The emulator writes the low byte first.
        self.request = int.from_bytes(REQUESTS[start].to_bytes(4, self.order), "little")
        listed = subprocess.run(["nm", "-S", file], capture_output=True, text=True, check=True).stdout
        symbols = [line.split() for line in listed.splitlines()]
        self.address = {s[-1]: int(s[0], 16) for s in symbols if len(s) > 2}
        code = [s for s in symbols if len(s) == 4 and s[2] in "tT" and "remora_" in s[3]]
        self.functions = sorted({int(s[0], 16) & ~1: s[3] for s in code if int(s[1], 16) >= 64}.items())
        self.iteration = next(at for at, name in self.functions if ITERATION in name)
        self.kind = 2 if target.startswith("thumb") else 4

    def start(self, folder, longest, *options):
        """Starts it, held at its first instruction, for so many seconds of processor time."""
        at, log = os.path.join(folder, "gdb"), os.path.join(folder, "log")
        for old in (at, log):
            Path(old).unlink(missing_ok=True)
        command = self.target["qemu"] + [
            "-display", "none", "-monitor", "none", "-serial", f"file:{log}", "-kernel", str(self.file),
            "-device", f"loader,addr={self.address['REMORA_REQUEST']:#x},data={self.request:#x},data-len=4",
            "-S", "-chardev", f"socket,path={at},server=on,wait=off,id=gdb", "-gdb", "chardev:gdb", *options,
        ]
        self.emulator = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                         preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (longest,) * 2))
        self.log = log
        stub = Stub(at)
        # QEMU answers single registers to whoever has asked for their list.
        stub.ask("qXfer:features:read:target.xml:0,fff")
        return stub

    def end(self):
        """Waits for its end: the emulator's status, and what the image printed."""
        status = self.emulator.wait()
        return status, Path(self.log).read_text(errors="replace")

    def break_at(self, stub, address, on):
        return stub.ask(f"{'Z' if on else 'z'}0,{address:x},{self.kind}")

    def register(self, stub, number):
        """The bytes of a register."""
        if not self.target.get("all"):
            return bytes.fromhex(stub.ask(f"p{number:x}"))
        size = self.target["bytes"]
        return bytes.fromhex(stub.ask("g"))[size * number:][:size]

    def set_register(self, stub, number, data):
        """Changes the bytes of a register."""
        if not self.target.get("all"):
            return stub.ask(f"P{number:x}={data.hex()}")
        registers, at = stub.ask("g"), 2 * self.target["bytes"] * number
        return stub.ask(f"G{registers[:at]}{data.hex()}{registers[at + 2 * len(data):]}")

    def pointer(self, stub, which):
        """The stack pointer or the program counter."""
        return int.from_bytes(self.register(stub, self.target[which]), self.order)


def lines(text):
    """Of each scenario what must repeat: stages, plan, residuals, what the verifier finds again."""
    kept = re.findall(r"^(?:stage|plan|residual|verified) scenario=(\S+) .*$", text, re.MULTILINE)
    found = {name: [] for name in dict.fromkeys(kept)}
    for line in text.splitlines():
        match = re.match(r"(?:stage|plan|residual|verified) scenario=(\S+) ", line)
        if match:
            found[match[1]].append(line)
    return found


def checksum(numbers):
    """64-bit FNV-1a of numbers by their bits, as the image has it."""
    value = 0xCBF2_9CE4_8422_2325
    for bits in numbers:
        for byte in int(bits, 16).to_bytes(8, "little"):
            value = (value ^ byte) * 0x100_0000_01B3 % 2**64
    return f"{value:016x}"


def is_consistent(plan):
    """Whether a plan is of the input that was meant, with the residuals that the verifier finds again."""
    text = "\n".join(plan)
    claimed = re.findall(r"^plan .* input=([0-9a-f]{16})", text, re.MULTILINE)
    claimed += re.findall(r"^residual .*?=([0-9a-f]{16})\(", text, re.MULTILINE)
    again = re.search(r"^verified .* claim=([0-9a-f]{16})", text, re.MULTILINE)
    return bool(again) and checksum(claimed) == again[1]


def is_whole(text):
    """Whether an image has printed its last line."""
    return text.endswith("\nend\n")


def classify(status, text, sound):
    """The class of a run."""
    plans = lines(text)
    if status in (-signal.SIGXCPU, -signal.SIGKILL):
        return "hung"
    if list(plans) != list(sound) or status != 0 or not is_whole(text):
        return "trapped"
    first, *others = sound
    if any(plans[name] != sound[name] for name in others):
        return "wrong"
    if plans[first] == sound[first]:
        return "same"
    text = "\n".join(plans[first])
    said = re.search(r"^plan .* status=(\d+) verified=(\d)", text, re.MULTILINE)
    if not said or not re.search(r"^verified .* accepted=yes$", text, re.MULTILINE):
        return "failed"
    if not is_consistent(plans[first]):
        return "wrong" if said[1] == SOLVED or said[2] == "1" else "failed"
    return "tolerated" if said[1] == SOLVED and said[2] == "1" else "failed"


def has_planned(image):
    """Whether the first plan has ended, and been accepted or not."""
    return "verified scenario=" in Path(image.log).read_text(errors="replace")


def look(image, folder, longest):
    """How many iterations of the QP solver the first plan has; functions called from their midst on."""
    stub = image.start(folder, longest)
    image.break_at(stub, image.iteration, True)
    iterations = 0
    while stub.ask("c") and not has_planned(image):
        iterations += 1
        stub.ask("s")
    image.emulator.kill()
    image.end()
    stub = image.start(folder, longest)
    go_to(image, stub, image.iteration, iterations // 2)
    names = dict(image.functions)
    for address in names:
        image.break_at(stub, address, True)
    called = []
    while stub.ask("c") and not has_planned(image):
        at = image.pointer(stub, "counter") & ~1
        if at in names:
            called.append(at)
            image.break_at(stub, at, False)
    image.emulator.kill()
    image.end()
    return iterations, sorted(called)


def go_to(image, stub, address, call=1):
    """Runs to a function's next call, or a later one; whether it comes there."""
    image.break_at(stub, address, True)
    answer = None
    for i in range(call):
        if i:
            stub.ask("s")
        answer = stub.ask("c")
    image.break_at(stub, address, False)
    return bool(answer) and answer.startswith("T")


def flip(word, share):
    """A bit of a word, at a share of it, and the word with it flipped."""
    bit = int(share * 8 * len(word))
    return bit, (int.from_bytes(word, "little") ^ 1 << bit).to_bytes(len(word), "little")


def strike(image, folder, longest, seen, seed, case):
    """Runs a case; what was struck, and what came of it."""
    iterations, called = seen
    draw = random.Random(f"{seed}:{case}")
    iteration, address = draw.randint(1, iterations), draw.choice(called)
    steps, place = draw.randint(0, STEPS), draw.choice(["register", "stack"])
    size = image.target["bytes"]
    number = draw.choice(image.target["registers"]) if place == "register" else draw.randrange(WORDS)
    share = draw.random()
    stub = image.start(folder, longest)
    is_there = go_to(image, stub, image.iteration, iteration)
    if address != image.iteration:
        is_there = is_there and go_to(image, stub, address)
    for _ in range(steps if is_there else 0):
        is_there = (stub.ask("s") or "W").startswith("T")
    if not is_there or has_planned(image):
        place, bit = "none", 0  # The function is not called any more, or not in the plan that is struck.
    elif place == "register":
        bit, flipped = flip(image.register(stub, number), share)
        image.set_register(stub, number, flipped)
    else:
        at = image.pointer(stub, "pointer") + number * size
        # Beyond the stack's end there is none: nothing is struck.
        word = stub.ask(f"m{at:x},{size:x}")
        bit, flipped = flip(bytes.fromhex(word) if not word.startswith("E") else bytes(size), share)
        stub.ask(f"M{at:x},{size:x}:{flipped.hex()}")
    stub.ask("D")
    status, text = image.end()
    return [case, place, number, bit, iteration, dict(image.functions)[address], steps], status, text


def lose_stack(image, stub):
    """Sends the stack pointer to the top quarter of all addresses, which is no memory of these boards."""
    size = image.target["bytes"]
    image.set_register(stub, image.target["pointer"], (3 << 8 * size - 2).to_bytes(size, image.order))


def never_return(image, stub):
    """Turns the function that is called next into a loop without an end."""
    loop = image.target["loop"]
    stub.ask(f"M{image.iteration:x},{len(loop) // 2:x}:{loop}")


def ends(image, folder, spoil):
    """Whether it ends in the fault handler when it is spoilt at the first iteration."""
    stub = image.start(folder, LEAST_LONGEST, *FAST)
    if not go_to(image, stub, image.iteration):
        return False
    spoil(image, stub)
    stub.ask("D")
    status, text = image.end()
    return status == image.target.get("fault", FAULT) and not is_whole(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", choices=TARGETS, default="thumbv7em-none-eabihf")
    parser.add_argument("--image", type=Path, help="the image [default: that of `cargo xtask firmware`]")
    parser.add_argument("--start", choices=REQUESTS, default="heuristic", help="what plans start from")
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--case", type=int, help="this case alone")
    parser.add_argument("--ends", action="store_true", help="whether it ends without its stack, and in a loop")
    parser.add_argument("--out", type=Path, help="a row a case (CSV); cases that it holds are not run again")
    given = parser.parse_args()
    root = Path(__file__).resolve().parent.parent
    built = Path(os.environ.get("CARGO_TARGET_DIR", root / "target")) / "firmware"
    file = given.image or built / f"{given.target}.elf"
    if not file.is_file():
        print(f"error: {file}: no such file; `cargo xtask firmware` builds it", file=sys.stderr)
        return 2
    image = Image(file, given.target, given.start)
    folder = tempfile.mkdtemp()
    if given.ends:
        spoils = {"its stack pointer is nowhere": lose_stack, "a function does not end": never_return}
        found = {what: ends(image, folder, spoil) for what, spoil in spoils.items()}
        for what, is_ended in found.items():
            print(f"{given.target}: {what}: {'ends' if is_ended else 'DOES NOT END'}")
        return 0 if all(found.values()) else 1
    stub = image.start(folder, 600)
    stub.ask("D")
    status, text = image.end()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    sound = lines(text)
    longest = max(LEAST_LONGEST, math.ceil(10 * (used.ru_utime + used.ru_stime)))
    if status != 0 or len(sound) != 2 or not all(map(is_consistent, sound.values())):
        print(f"error: {file}: does not plan two scenarios without a fault", file=sys.stderr)
        return 2
    seen = look(image, folder, 600)
    head = ["case", "place", "number", "bit", "iteration", "function", "steps", "class"]
    rows = []
    if given.out and given.out.is_file():
        with given.out.open(newline="") as table:
            rows = [row for row in list(csv.reader(table))[1:] if len(row) == len(head)]
    done = {int(row[0]) for row in rows}
    cases = [given.case] if given.case is not None else [n for n in range(given.cases) if n not in done]
    for i, case in enumerate(cases):
        struck, status, text = strike(image, folder, longest, seen, given.seed, case)
        rows.append([*map(str, struck), classify(status, text, sound)])
        if given.out:
            beside = given.out.with_name(given.out.name + ".partial")
            with beside.open("w", newline="") as table:
                csv.writer(table).writerows([head, *rows])
            beside.replace(given.out)
        print(f"{i + 1}/{len(cases)}  {', '.join(rows[-1])}", file=sys.stderr)
    classes = ["same", "tolerated", "failed", "trapped", "hung", "wrong"]
    print(f"{'place':10}" + "".join(f"{name:>10}" for name in ["cases", *classes]))
    for place in ["register", "stack"]:
        of = [row[-1] for row in rows if row[1] == place]
        print(f"{place:10}{len(of):10}" + "".join(f"{of.count(name):10}" for name in classes))
    return 1 if any(row[-1] == "wrong" for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
