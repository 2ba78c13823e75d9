"""Runs every code block of docs/logs.md and docs/python.md in a folder with a flight, and the example, and compiles what
they print for C. Run by test/checks/tune."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import encode  # noqa: E402

ROOT = encode.ROOT


def run(command, folder, label):
    environment = {**os.environ, "PIP_NO_BUILD_ISOLATION": "0", "PIP_NO_DEPS": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1",
                   "PIP_QUIET": "1", "PATH": f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        sys.exit(f"docs: {label} ends with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def blocks(page):
    return re.findall(r"^```(\w+)\n(.*?)^```", (ROOT / "docs" / page).read_text(), re.M | re.S)


def compile_c(printed):
    code = '#include "pflight/pflight.h"\n' + printed[printed.index("static const"):].split("\n\n")[0]
    code += "\nconst void *used(void);\nconst void *used(void) { return &%s_arena == 0 ? 0 : (const void *)&%s_config; }\n"
    name = re.search(r"PFL_ARENA\((\w+)_arena", code).group(1)
    subprocess.run(["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-address", f"-I{ROOT}/lib/include", "-fsyntax-only", "-xc", "-"],
                   input=code.replace("%s", name), text=True, check=True)


def main():
    with tempfile.TemporaryDirectory(prefix="pflight-docs-") as name:
        folder, count = pathlib.Path(name), 0
        tables, _ = encode.recorded(rows=300)
        encode.write_ulog(tables, folder / "flight.ulg")
        encode.write_table(tables, folder / "flight.csv")
        for page in ("logs.md", "python.md"):
            python = []
            for kind, text in blocks(page):
                count += 1
                if kind == "python":
                    python.append(text)  # one block goes on from another
                    run([sys.executable, "-c", "\n".join(python)], folder, f"{page}, block {count}")
                else:
                    run(["bash", "-ec", re.sub(r"\btools/", f"{ROOT}/tools/", text)], folder, f"{page}, block {count}")
        example = run([sys.executable, str(ROOT / "tools/python/examples/tune_flight.py"), "log"], folder, "the example")
        compile_c(example)
        print(f"{count} blocks and the example run")
        print("\n".join(example.splitlines()[:9]))


if __name__ == "__main__":
    main()
