"""Writes the C file of the module for CMake: generate.py OUT."""
import pathlib
import sys

import cffi

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import headers  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
CALLBACKS = """
extern "Python" {
    void pflight_py_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p);
    void pflight_py_loglik(void *user, const void *z, const pfl_view_t *p, float *ll);
    void pflight_py_draw(void *user, const pfl_batch_t *p);
}
"""


def main():
    ffi = cffi.FFI()
    ffi.cdef(headers.declarations(HERE.parent.parent / "lib"))
    ffi.cdef(headers.plain((HERE / "glue.h").read_text()) + CALLBACKS)
    ffi.set_source("pflight._pflight", '#include "pflight/pflight.h"\n#include "glue.h"')
    ffi.emit_c_code(sys.argv[1])


if __name__ == "__main__":
    main()
