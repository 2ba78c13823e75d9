"""The generated blocks of docs/performance.md: between <!-- begin:NAME --> and <!-- end:NAME -->."""
import re

from measure import ROOT, Failure

PATH = ROOT / "docs/performance.md"


def replaced(text, name, table):
    pattern = re.compile(rf"(<!-- begin:{name} -->\n).*?(<!-- end:{name} -->)", re.S)
    if not pattern.search(text):
        raise Failure(f"docs/performance.md has no block {name}")
    return pattern.sub(lambda match: match[1] + table + "\n" + match[2], text)


def write(name, table):
    PATH.write_text(replaced(PATH.read_text(), name, table))


def is_stale(name, table):
    text = PATH.read_text()
    return replaced(text, name, table) != text
