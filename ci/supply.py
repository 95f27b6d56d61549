#!/usr/bin/env python3
"""Dependencies that fly: docs/flight.cdx.json, a bill of materials (CycloneDX 1.5), and the table of
docs/evidence/verification.md.

Takes the crates below the flight crates from Cargo, their checksums from the lock file, and counts lines and uses
of `unsafe` in their sources. Both files are a function of the lock file: no date, no random number.

    ci/supply.py           writes them
    ci/supply.py --check   ends with 1 where they are not what it would write
"""

import json
import os
import re
import subprocess
import sys
import tomllib
import uuid
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE, BILL = ROOT / "docs/evidence/verification.md", ROOT / "docs/flight.cdx.json"
BEGIN, END = "<!-- table: ci/supply.py -->", "<!-- end of table -->"
# The crate above all others that fly.
TOP = "remora-capi"

# Where code runs that does not fly: in the compiler only, or on other platforms. Of all others, their use.
BUILDS, ELSEWHERE = "builds", "elsewhere"
USE = {
    "approx": "of nalgebra",
    "autocfg": BUILDS,
    "byteorder": "of hash32",
    "cobs": "of postcard",
    "cpufeatures": "finds vector instructions",
    "hash32": "of heapless",
    "heapless": "bounded vectors",
    "libc": ELSEWHERE,
    "libm": "elementary functions",
    "nalgebra": "matrices of fixed size",
    "num-complex": "of simba",
    "num-integer": "of num-rational",
    "num-rational": "of nalgebra",
    "num-traits": "of nalgebra",
    "postcard": "reads a model's header",
    "proc-macro2": BUILDS,
    "quote": BUILDS,
    "serde": "of postcard",
    "serde_core": "of postcard",
    "serde_derive": BUILDS,
    "simba": "of nalgebra",
    "stable_deref_trait": "of heapless",
    "syn": BUILDS,
    "thiserror": "of cobs",
    "thiserror-impl": BUILDS,
    "typenum": "of nalgebra",
    "unicode-ident": BUILDS,
}


def tree():
    """The flight crates' dependencies as Cargo resolves them: by name, with the names that each depends on."""
    command = ["cargo", "tree", "--locked", "-p", TOP, "-e", "no-dev", "--target", "all", "--no-dedupe",
               "--prefix", "depth", "--format", "|{p}"]
    lines = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    crates, path = {}, []
    for line in lines:
        depth, crate = line.split("|", 1)
        name, version = crate.split()[:2]
        path[int(depth):] = [name]
        crates.setdefault(name, (version.removeprefix("v"), set()))
        if len(path) > 1:
            crates[path[-2]][1].add(name)
    return dict(sorted(crates.items()))


def sources(name, version):
    """Where the sources are that Cargo has fetched."""
    home = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    return next((home / "registry/src").glob(f"*/{name}-{version}"))


def code(text):
    """A file's code without comments and text in quotes."""
    text = re.sub(r"/\*.*?\*/", "", re.sub(r"//[^\n]*", "", text), flags=re.S)
    return re.sub(r'"(\\.|[^"\\])*"', '""', text, flags=re.S)


def counts(folder):
    """Lines of code, and uses of `unsafe`; tests and benches of the crate's own are not among them."""
    files = [code(file.read_text(errors="replace")) for file in sorted((folder / "src").rglob("*.rs"))]
    lines = sum(1 for text in files for line in text.splitlines() if line.strip())
    return lines, sum(len(re.findall(r"\bunsafe\b", text)) for text in files)


def who(manifest):
    """Authors as the manifest names them, or else whose repository it is."""
    authors = [author.split("<")[0].strip() for author in manifest.get("authors", [])]
    if not authors:
        return manifest.get("repository", "").removeprefix("https://").removesuffix(".git")
    return ", ".join(authors[:2]) + (" and others" if len(authors) > 2 else "")


def component(name, version, lock, manifest):
    """A crate in the bill."""
    purl = f"pkg:cargo/{name}@{version}"
    found = {"type": "library", "bom-ref": purl, "name": name, "version": version, "purl": purl,
             "licenses": [{"expression": manifest["license"].replace("/", " OR ")}]}
    if checksum := lock.get((name, version)):
        found["hashes"] = [{"alg": "SHA-256", "content": checksum}]
    if author := who(manifest):
        found["author"] = author
    if repository := manifest.get("repository"):
        found["externalReferences"] = [{"type": "vcs", "url": repository}]
    return found


def documents():
    """The bill and the table."""
    packages = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    lock = {(package["name"], package["version"]): package.get("checksum") for package in packages}
    crates, components, rows = tree(), [], []
    own = {"version": "0.1.0", "license": "MIT OR Apache-2.0"}
    for name, (version, _) in crates.items():
        if name.startswith("remora-"):
            components.append(component(name, version, lock, own))
            continue
        folder = sources(name, version)
        manifest = tomllib.loads((folder / "Cargo.toml").read_text())["package"]
        components.append(component(name, version, lock, manifest))
        lines, unsafe = counts(folder)
        rows.append(f"| {name} {version} | {USE[name]} | {lines:,} | {unsafe:,} |")
    head = "| crate | use | lines | `unsafe` |\n| --- | --- | --: | --: |\n"
    refs = {name: f"pkg:cargo/{name}@{version}" for name, (version, _) in crates.items()}
    edges = [{"ref": refs[name], "dependsOn": sorted(refs[other] for other in below)}
             for name, (_, below) in crates.items()]
    bill = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
            "metadata": {"component": {"type": "library", "bom-ref": "flight", "name": "Remora, what flies",
                                       "version": own["version"]}},
            "components": components,
            "dependencies": [{"ref": "flight", "dependsOn": [refs[TOP]]}] + edges}
    serial = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(bill, sort_keys=True))
    return json.dumps({"serialNumber": f"urn:uuid:{serial}"} | bill, indent=1) + "\n", head + "\n".join(rows) + "\n"


def main():
    bill, table = documents()
    before, rest = PAGE.read_text().split(BEGIN)
    page = f"{before}{BEGIN}\n\n{table}\n{END}{rest.split(END)[1]}"
    wanted = {PAGE: page, BILL: bill}
    if "--check" in sys.argv[1:]:
        stale = [str(file.relative_to(ROOT)) for file, text in wanted.items()
                 if not file.exists() or file.read_text() != text]
        for file in stale:
            print(f"error: {file}: not what the lock file says; ci/supply.py writes it", file=sys.stderr)
        return 1 if stale else 0
    for file, text in wanted.items():
        file.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
