"""The blocks of code of the Markdown pages, and what runs them. Each block is accounted for by exactly one test: by the one
that OWNERS names, or by this, which for a page of its own does, from top to bottom:

    c       compiled with the project's warnings by gcc and clang, linked and run. A block that begins with #include begins a
            program, one without goes on with it; one that begins with a comment of a file's name is that file, compiled alone
    sh      run, in a folder that has a flight: flight.ulg, flight.csv, log; tools/ is the repository's
    python  run, behind the blocks of the page before it
    cmake   a CMakeLists.txt for a Cortex-M4F, behind a project `firmware`, configured and its port built
    text    what the block above it prints

`<!-- not run: REASON -->` above a block leaves a long command out: its tool, subcommand and options must exist, and a
tools/run flies once; so it is with commands that are indented by four spaces. Anything else is a complaint.
"""
import functools
import os
import pathlib
import re
import shlex
import subprocess
import sys

from markdown_it import MarkdownIt

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON = ROOT / "build/python-venv/bin/python"
LINES = 120  # an example has less
RUN_DOCS = "test/logs/run_docs.py"
OWNERS = {  # page: the languages that another test takes, and that test
    "README.md": ({"c"}, "test/checks/readme"),
    "docs/first_filter.md": ({"sh", "c", "cmake"}, "test/newcomer"),
    "docs/vendoring.md": ({"sh", "cmake", "make"}, "test/checks/consumers"),
    "docs/logs.md": ({"sh"}, RUN_DOCS),
    "docs/python.md": ({"sh", "python"}, RUN_DOCS)}
WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Wpedantic", "-Wconversion", "-Wshadow",
            "-Wdouble-promotion", "-Wcast-align", "-Wfloat-equal", "-Werror", f"-I{ROOT}/lib/include"]
CORTEX_M4F = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]
FILE = re.compile(r"/\* (\w+\.c)\b")
SECONDS = 60


class Complaint(Exception):
    """What is wrong with a block."""


class Block:
    """A fenced block, or one that is indented (language ""), with what the line above it asks for."""

    def __init__(self, page, token, before):
        self.where = f"{page}:{token.map[0] + 1}"
        self.fenced = token.type == "fence"
        self.language = token.info.strip() if self.fenced else ""
        self.text = token.content
        self.not_run = before is not None and re.match(r"<!-- not run: \S.* -->", before.content) is not None


def blocks_of(page, text):
    tokens = MarkdownIt().parse(text)
    return [Block(page, token, tokens[k - 1] if k and tokens[k - 1].type == "html_block" else None)
            for k, token in enumerate(tokens) if token.type in ("fence", "code_block")]


def run(command, folder, **more):
    """(exit code, standard output, both outputs) of a command."""
    environment = {**os.environ, "PIP_NO_BUILD_ISOLATION": "0", "PIP_NO_DEPS": "1", "PIP_QUIET": "1",
                   "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PYTHONPATH": str(ROOT / "build/guide-peers"),
                   "PATH": f"{PYTHON.parent}:{os.environ['PATH']}"}
    try:
        done = subprocess.run([str(part) for part in command], cwd=folder, env=environment, text=True, timeout=SECONDS,
                              stdin=subprocess.DEVNULL, capture_output=True, check=False, **more)
    except subprocess.TimeoutExpired:
        raise Complaint(f"takes more than {SECONDS} s: {command[-1]}") from None
    return done.returncode, done.stdout, done.stdout + done.stderr


def must(command, folder, codes=(0,)):
    code, out, everything = run(command, folder)
    if code not in codes:
        raise Complaint(f"ends with {code}:\n{everything[-2000:]}")
    return out


# ---- Commands that are not run --------------------------------------------------------------------------------------

@functools.lru_cache(maxsize=None)
def help_of(*command):
    """What a tool says of itself; None where it does not know the command."""
    code, _, said = run([ROOT / command[0], *command[1:], "--help"], ROOT)
    return said if code == 0 else None


def look_at(line, folder):
    """One command of the repository: tool, subcommand, options; what stands in brackets may be left out, of a|b the
    first is taken."""
    words = [word.split("|")[0] for word in shlex.split(re.sub(r"[\[\]]", " ", line), comments=True)]
    if not words:
        return False
    if not words[0].startswith("tools/"):  # another program's: what is ours in it must exist
        for path in re.findall(r"\bpflight/([\w./-]+)", line):
            if not (ROOT / path).exists():
                raise Complaint(f"there is no {path}")
        return False
    if not os.access(ROOT / words[0], os.X_OK):
        raise Complaint(f"there is no {words[0]}")
    if words[0] == "tools/run" and len(words) > 1:
        must([ROOT / words[0], *words[1:], "--runs", "1", "--threads", "1"], folder, (0, 1))
        return True
    known = help_of(words[0])
    if len(words) > 1 and re.fullmatch(r"[a-z]+", words[1]):
        own = help_of(words[0], words[1])
        if own is None or words[1] not in known + (own if own != known else ""):
            raise Complaint(f"{words[0]} knows no '{words[1]}'")
        known += own
    for option in (word.split("=")[0] for word in words if word.startswith("--")):
        if not re.search(rf"(?<![\w-]){option}(?![\w-])", known):
            raise Complaint(f"{words[0]} knows no {option}")
    return True


def look_at_all(text, folder):
    looked = [look_at(line, folder) for line in text.replace("\\\n", " ").splitlines()]
    if not any(looked) and not re.search(r"\bpflight/|--preset", text):
        raise Complaint("is indented, and holds no command of this repository: fence it, or make it prose")


# ---- Blocks that are run --------------------------------------------------------------------------------------------

class Page:
    """Runs the blocks of one page."""

    def __init__(self, name, text, folder):
        self.name, self.folder, self.blocks = name, folder, blocks_of(name, text)
        self.owned, self.owner = OWNERS.get(name, ((), None))
        self.count = {"run": 0, "looked at": 0, "elsewhere": 0}
        self.program, self.python, self.before, self.said = "", "", "", None
        self.programs = 0

    def compile_and_run(self):
        self.programs += 1
        program = self.folder / f"program{self.programs}"
        source = program.with_suffix(".c")
        source.write_text(self.program)
        if len(self.program.splitlines()) >= LINES:
            raise Complaint(f"is a program of {LINES} lines or more")
        own = [] if "pfl_port_cycles(void)" in self.program else [ROOT / "build/run/libpflight_port_posix.a"]
        must(["clang", *WARNINGS, "-fsyntax-only", source], self.folder)
        must(["gcc", "-O2", *WARNINGS, source, ROOT / "build/run/libpflight.a", *own, "-o", program], self.folder)
        self.program = ""
        return must([program], self.folder)

    def take_c(self, text):
        named = FILE.match(text)
        if named:
            (self.folder / named[1]).write_text(text)
            must(["gcc", *WARNINGS, "-c", named[1], "-o", named[1] + ".o"], self.folder)
        elif "#include" not in text and not self.program:
            raise Complaint("goes on with a program, and there is none above it")
        else:
            self.program += text
        self.said = None

    def take_sh(self, text):
        if len(text.splitlines()) >= LINES:
            raise Complaint(f"has {LINES} lines or more")
        self.said = must(["bash", "-euc", re.sub(r"(?<![\w./])tools/", f"{ROOT}/tools/", text)], self.folder)

    def take_python(self, text):
        self.python += text
        said = must([PYTHON, "-B", "-c", self.python], self.folder)
        self.said, self.before = said[len(self.before):], said

    def take_cmake(self, text):
        folder = self.folder / "firmware"
        folder.mkdir(exist_ok=True)
        (folder / "main.c").write_text("int main(void) { return 0; }\n")
        head = "cmake_minimum_required(VERSION 3.16)\nproject(firmware C)\nadd_executable(firmware main.c)\n"
        (folder / "CMakeLists.txt").write_text(head + text.replace("(pflight)", f"({ROOT} pflight)"))
        must(["cmake", "-S", folder, "-B", folder / "build", "-DCMAKE_SYSTEM_NAME=Generic", "-DCMAKE_SYSTEM_PROCESSOR=cortex-m4",
              "-DCMAKE_C_COMPILER=arm-none-eabi-gcc", "-DCMAKE_C_FLAGS=" + " ".join(CORTEX_M4F),
              "-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY"], folder)
        ports = re.findall(r"pflight::(port_\w+)", text)
        must(["cmake", "--build", folder / "build", "--target", *(f"pflight_{port}" for port in ports)], folder)

    def take_text(self, text):
        """What was printed above."""
        if self.program:
            self.said = self.compile_and_run()
        if self.said is None:
            raise Complaint("is the output of nothing")
        if self.said.strip() != text.strip():
            raise Complaint(f"is not what is printed:\n{self.said}")

    def take(self, block):
        if block.language in self.owned:
            self.count["elsewhere"] += 1
        elif block.not_run or not block.fenced:
            self.count["looked at"] += 1
            if block.language in ("", "sh"):
                look_at_all(block.text, self.folder)
            elif block.language != "text":
                raise Complaint(f"is {block.language}, and not run")
        elif hasattr(self, f"take_{block.language}"):
            if self.program and block.language != "text" and not (block.language == "c" and "#include" not in block.text):
                self.compile_and_run()
            getattr(self, f"take_{block.language}")(block.text)
            self.count["run"] += 1
        else:
            raise Complaint(f"is a block of '{block.language}' that no test accounts for")

    def complaints(self):
        """Runs everything; what is wrong, a line or more each."""
        found = []
        if self.owner and pathlib.Path(self.name).name not in (ROOT / self.owner).read_text():
            found.append(f"{self.name}: {self.owner} does not speak of it")
        block = None
        for block in self.blocks:
            try:
                self.take(block)
            except Complaint as complaint:
                found.append(f"{block.where}: {complaint}")
                self.program = ""
        if self.program:
            try:
                self.compile_and_run()
            except Complaint as complaint:
                found.append(f"{block.where}: {complaint}")
        return found
