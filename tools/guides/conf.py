"""Settings of the guide for Sphinx: the pages are the Markdown files of the repository as they stand, so that they read
the same on a forge. The contents are the links of docs/index.md; a link to a public header leads to its reference.
"""
import pathlib
import re

project = "pflight"
author = "the pflight authors"
copyright = author
version = release = re.search(r'PFL_VERSION "(.*)"',
                              (pathlib.Path(__file__).parents[2] / "lib/include/pflight/version.h").read_text())[1]

extensions = ["myst_parser"]
root_doc = "docs/index"
include_patterns = ["docs/*.md", "docs/guide/*.md", "*.md", "examples/*.md", "lib/doc/*.md", "port/*/README.md"]
exclude_patterns = ["build", "out"]
myst_heading_anchors = 3
nitpicky = True

html_theme = "alabaster"
html_theme_options = {"description": "a particle filter for flight computers", "page_width": "1280px", "body_max_width": "auto",
                      "fixed_sidebar": True}
html_copy_source = False
html_show_sourcelink = False

HEADER = re.compile(r"\[([^\]]+)\]\((?:\.\./)*lib/include/pflight/(\w+)\.h\)")


def contents(text):
    """A hidden toctree under each heading of the index, of the links below it."""
    parts = re.split(r"(?m)^(?=## )", text)
    for k, part in enumerate(parts):
        pages = re.findall(r"\[([^\]]+)\]\(([\w./-]+)\.md\)", part)
        if k > 0 and pages:
            entries = "\n".join(f"{title} <{name}>" for title, name in pages)
            parts[k] += f"\n```{{toctree}}\n:hidden:\n:caption: {part.splitlines()[0][3:]}\n\n{entries}\n```\n\n"
    return "".join(parts)


def read(_app, page, source):
    up = "../" * page.count("/")
    source[0] = HEADER.sub(rf'<a href="{up}reference/html/\2_8h.html">\1</a>', source[0])
    if page == root_doc:
        source[0] = contents(source[0])


def setup(app):
    app.connect("source-read", read)
    return {"parallel_read_safe": True}
