"""The pages of the guide, by the rules of blocks.py, and what else they promise. Run by test/checks/guide, which has built
what this needs."""
import concurrent.futures
import pathlib
import re
import shutil
import subprocess
import sys

import blocks

ROOT = blocks.ROOT
OUT = ROOT / "build/check-guide"
PAGES = ["README.md", "CONTRIBUTING.md", "examples/README.md", *(str(path.relative_to(ROOT)) for path in
         [*sorted(ROOT.glob("docs/**/*.md")), *sorted(ROOT.glob("port/*/README.md"))])]
WRONG = {  # a page that must be complained of: what the complaint says
    "```c\n#include <stdio.h>\nint main(void) { int x; return 0; }\n```\n": "unused variable",
    "```c\n#include <stdio.h>\nint main(void) { puts(\"a\"); return 0; }\n```\n\n```text\nb\n```\n": "is not what is printed",
    "```c\n#include <stdio.h>\nint main(void) { return 1; }\n```\n": "ends with 1",
    "```c\nint x;\n```\n": "goes on with a program",
    "```python\nassert 1 + 1 == 3\n```\n": "AssertionError",
    "```sh\ntools/log columns /nowhere\n```\n": "ends with",
    "```rust\nfn main() {}\n```\n": "no test accounts for",
    "```\nint x;\n```\n": "no test accounts for",
    "```text\n1\n```\n": "is the output of nothing",
    "    tools/bench host --fast\n": "knows no --fast",
    "    tools/survival gate\n": "knows no 'gate'",
    "    tools/benches host\n": "there is no tools/benches",
    "    tools/run standoff --set tries=maybe\n": "ends with 2",
    "    x = y + z\n": "holds no command",
    "<!-- not run: long -->\n\n```sh\ntools/study --everything\n```\n": "knows no --everything",
    "```c\n#include <stdio.h>\n" + "/**/\n" * 120 + "int main(void) { return 0; }\n```\n": "120 lines or more"}


def folder_of(name):
    """A folder for a page, with a flight."""
    folder = OUT / re.sub(r"\W", "-", name)
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(OUT / "flight", folder)
    return folder


def try_page(name, text=None):
    page = blocks.Page(name, (ROOT / name).read_text() if text is None else text, folder_of(name))
    return page, page.complaints()


def make_a_flight():
    shutil.rmtree(OUT / "flight", ignore_errors=True)
    (OUT / "flight").mkdir(parents=True)
    code = """
import pathlib, sys
sys.path.insert(0, sys.argv[1])
import encode
tables, _ = encode.recorded(rows=300)
encode.write_ulog(tables, pathlib.Path("flight.ulg"))
encode.write_table(tables, pathlib.Path("flight.csv"))
"""
    subprocess.run([blocks.PYTHON, "-B", "-c", code, ROOT / "test/logs"], cwd=OUT / "flight", check=True)
    subprocess.run([ROOT / "tools/log", "import", "flight.ulg", "--out", "log"], cwd=OUT / "flight", check=True,
                   stdout=subprocess.DEVNULL)


# ---- What else the pages promise --------------------------------------------------------------------------------------

def flags():
    """Every flag of the header has a row of its own on the page, and no row is without one."""
    header = set(re.findall(r"#define (PFL_(?:FAULT|MODE|EVENT)_\w+)", (ROOT / "lib/include/pflight/health.h").read_text()))
    rows = re.findall(r"^\| `(PFL_\w+)` \| \S.* \| \S.* \|$", (ROOT / "docs/guide/flags.md").read_text(), re.M)
    yield from (f"docs/guide/flags.md: no row, or more than one, for {name}" for name in header if rows.count(name) != 1)
    yield from (f"docs/guide/flags.md: health.h has no {name}" for name in rows if name not in header)


def names():
    """Every name of the library that a page uses exists."""
    places = [*ROOT.glob("lib/**/*"), *ROOT.glob("port/**/*"), *ROOT.glob("test/**/*.[ch]"), ROOT / "CMakeLists.txt",
              ROOT / "tools/amalgamate"]
    sources = "\n".join(path.read_text() for path in places if path.suffix in ("", ".h", ".c", ".cmake", ".txt", ".cpp")
                        and path.is_file())
    known = set(re.findall(r"\b(?:pfl|PFL|pflight|PFLIGHT)_\w+", sources))
    for page in PAGES:
        used = set(re.findall(r"\b(?:pfl|PFL)_[a-zA-Z]\w*[a-zA-Z0-9](?![\w*])", (ROOT / page).read_text()))
        yield from (f"{page}: there is no {name}" for name in sorted(used - known))


def port():
    """The port of the page: 20 lines, and it counts on an emulated board."""
    source = OUT / "docs-guide-porting-md/port_board.c"
    lines = len(source.read_text().splitlines())
    if lines > 20:
        yield f"docs/guide/porting.md: the port has {lines} lines"
    if not shutil.which("arm-none-eabi-gcc"):
        print("guide: no arm-none-eabi-gcc: the port of the guide is compiled on the host only")
        return
    board = ROOT / "tools/targets/board"
    image = OUT / "port.elf"
    subprocess.run(["arm-none-eabi-gcc", "-O2", *blocks.CORTEX_M4F, *blocks.WARNINGS, "-ffp-contract=off", "-fno-math-errno",
                    "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-nostartfiles", "-specs=nosys.specs",
                    "-Wl,--no-warn-rwx-segments", "-Wl,--defsym=BOARD_FLASH=0x08000000,--defsym=BOARD_FLASH_BYTES=0x100000",
                    "-Wl,--defsym=BOARD_RAM=0x20000000,--defsym=BOARD_RAM_BYTES=0x20000,--defsym=BOARD_STACK_BYTES=0x2000",
                    "-T", board / "cortex_m.ld", board / "startup_cortex_m.c", ROOT / "test/guide/board_main.c", source,
                    *sorted(ROOT.glob("lib/src/*.c")), "-o", image], check=True)
    if not shutil.which("qemu-system-arm"):
        print("guide: no qemu-system-arm: the port of the guide is built, and not run")
        return
    done = subprocess.run(["timeout", "20", "qemu-system-arm", "-M", "netduinoplus2", "-icount", "shift=0", "-display", "none",
                           "-monitor", "none", "-serial", "none", "-chardev", "stdio,id=sh", "-semihosting-config",
                           "enable=on,target=native,chardev=sh", "-kernel", image], capture_output=True, text=True, check=False,
                          stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        yield f"docs/guide/porting.md: on the emulated board step {done.returncode} fails: {done.stdout}{done.stderr}"
    print(f"guide: the port of the guide has {lines} lines: {done.stdout.strip()}")


def links():
    """What the site's pages link to on this machine is there: the reference too, which Sphinx knows nothing of."""
    site, count = ROOT / "build/guide", 0
    for page in [path for path in site.rglob("*.html") if site / "reference" not in path.parents]:
        for link in re.findall(r'href="([^"#:]+\.html)(?:#[^"]*)?"', page.read_text()):
            count += 1
            if not (page.parent / link).is_file():
                yield f"{page.relative_to(ROOT)}: there is no {link}"
    if count < 1000:
        yield f"{count} links only are found in the site"


def wrong_link():
    """Would Sphinx see a wrong link, and a page that the index leaves out?"""
    folder = OUT / "wrong-link/docs"
    shutil.rmtree(folder.parent, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "index.md").write_text("# A\n\n## B\n\n- [C](c.md)\n")
    (folder / "c.md").write_text("# C\n\n[D](c.md#nowhere)\n")
    (folder / "e.md").write_text("# E\n")
    done = subprocess.run([ROOT / "build/guide-venv/bin/sphinx-build", "-q", "-W", "--keep-going", "-c", ROOT / "tools/guides",
                           folder.parent, folder.parent / "site"], capture_output=True, text=True, check=False)
    for complaint in ("local id not found", "isn't included in any toctree"):
        if done.returncode == 0 or complaint not in done.stderr:
            yield f"Sphinx does not say '{complaint}': {done.stderr}"


def wrong_block(number):
    """Would this one be seen?"""
    text, expected = list(WRONG.items())[number]
    complaints = "\n".join(try_page(f"wrong-{number}.md", text)[1])
    return [] if expected in complaints else [f"a wrong block goes unnoticed, '{expected}' was expected:\n{text}{complaints}"]


def main():
    make_a_flight()
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        tried = list(pool.map(try_page, PAGES))
        unseen = sum(pool.map(wrong_block, range(len(WRONG))), [])
    bad = [line for _, complaints in tried for line in complaints]
    count = {what: sum(page.count[what] for page, _ in tried) for what in ("run", "looked at", "elsewhere")}
    whole = sum(len(page.blocks) for page, _ in tried)
    if not bad and sum(count.values()) != whole:
        bad.append(f"{whole} blocks, and {count} of them accounted for")
    bad += [*unseen, *flags(), *names(), *port(), *links(), *wrong_link()]
    print("\n".join(bad), end="\n" * bool(bad))
    print(f"{len(PAGES)} pages, {whole} blocks: {count['run']} compiled, run or compared here, {count['elsewhere']} by "
          f"{len({test for _, test in blocks.OWNERS.values()})} other tests, {count['looked at']} lists of commands looked at; "
          f"{len(WRONG)} wrong blocks tried; {len(bad)} complaints")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
