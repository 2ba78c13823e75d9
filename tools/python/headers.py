"""The library's public headers as cffi wants them: plain declarations, without preprocessor, C++ and comments.

What is declared here is checked against the headers themselves when the module is compiled."""
import pathlib
import re

LEFT_OUT = {"pflight.h", "per_particle.h", "port.h"}  # an include, macros, and what the port provides


def sources(lib):
    """The library's list of files (lib/pflight.cmake): sources, headers and the flags that the bits depend on."""
    text = (lib / "pflight.cmake").read_text()

    def listed(name):
        return re.search(rf"^set\({name}\n(.*?)^\)", text, re.M | re.S).group(1).split()

    flags = re.findall(r"^    (-f[a-z-]+(?:=[a-z]+)?)$", text, re.M)
    return listed("PFLIGHT_LIB_SOURCES"), listed("PFLIGHT_LIB_HEADERS"), flags


def declarations(lib):
    """Declarations of every public header in the order in which they include one another, each once."""
    _, headers, _ = sources(pathlib.Path(lib))
    done, parts = set(), []

    def take(name):
        if name in done or name in LEFT_OUT:
            return
        done.add(name)
        text = (pathlib.Path(lib) / "include/pflight" / name).read_text()
        for other in re.findall(r'#include "pflight/(\w+\.h)"', text):
            take(other)
        parts.append(plain(text))

    for name in headers:
        take(name)
    return "\n".join(parts)


def plain(text):
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S).replace("\\\n", " ")
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    text = re.sub(r"static inline [^;{]*\{.*?^\}", "", text, flags=re.S | re.M)
    constants = re.findall(r"^#define (PFL_\w+) +(\d\w*|0x\w+)\s*$", text, re.M)
    text = re.sub(r"^\s*#.*$", "", text, flags=re.M)
    text = "".join(f"#define {name} {value}\n" for name, value in constants if re.fullmatch(r"(0x)?[0-9A-Fa-f]+u?", value)) + text
    # An array as long as a macro says: the compiler fills it in.
    text = re.sub(r"\[[^\[\]]*[A-Z_]+\([^\[\]]*\]", "[...]", text)
    return re.sub(r"\n\s*\n+", "\n", text)
