"""Names that reach C: a name that the compilers or the C library know is refused, or compiles unchanged. The test asks them for their
names, so that a newer compiler is covered, too."""
import re
import subprocess

import pytest

from program import LONG, SOURCE, refdyn, some

WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror".split()
COMPILERS = [[compiler, f"-std={standard}", "-x", language] for compiler, standard, language in [
    ("gcc", "c11", "c"), ("gcc", "gnu17", "c"), ("gcc", "c2x", "c"), ("clang", "c11", "c"), ("g++", "c++17", "c++"),
    ("g++", "gnu++20", "c++"), ("clang++", "c++17", "c++")]]
# Machines whose predefined macros clang prints for their names alone.
MACHINES = """arm-none-eabi aarch64-linux-gnu avr i686-pc-windows-gnu i386-pc-solaris2.11 m68k-linux-gnu mips-linux-gnu mipsel-linux-gnu msp430
    powerpc-linux-gnu powerpc64-ibm-aix riscv64-linux-gnu s390x-linux-gnu sparc-sun-solaris2.11 sparc-linux-gnu wasm32 x86_64-apple-darwin
    x86_64-pc-windows-msvc x86_64-w64-mingw32 x86_64-unknown-freebsd""".split()
WORDS = """
alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t char8_t class co_await co_return
co_yield compl complex concept const const_cast consteval constexpr constinit continue decltype default delete do double
dynamic_cast else enum explicit export extern false far final float for friend goto I if imaginary import inline int long module
mutable namespace near new noexcept noreturn not not_eq nullptr operator or or_eq override private protected public register
reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast struct switch template this
thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using virtual void volatile wchar_t while
xor xor_eq linux unix i386 errno NULL EOF stdin assert main sin cos fmin fmax pow exp abs free malloc memcpy strlen index round
size_t double_t j0 y0 gamma signgam math_errhandling M_PI M_E HUGE_VALF FP_NAN NAN INFINITY MATH_ERRNO t q qd p x out e i j M h Q
SET ELEMENT_1 start anchored inputs zeros value name self constant_1 row_1 t1 strtok_r REFDYN_MODEL_H REFDYN_POSITION
""".split()

SCENE = """local rd = require "refdyn"
local words, kind = {{ {words} }}, rd.option("kind", "parameters", {{ "parameters", "inputs", "links", "points" }})
local list, links, points, force, sum = {{}}, {{}}, {{}}, 0, 0
for i, word in ipairs(words) do
  if kind == "parameters" then list[i] = {{ word, i, "N" }}
  elseif kind == "inputs" then force = force + i * rd.input(word, 1)
  elseif kind == "links" then links[i] = {{ word, on = links[1] and "a", joint = i % 2 == 0 and "psi" or "z", mass = 1, inertia = {{ xx = 1, yy = 1, zz = 1 }} }}
  else points[word] = {{ on = "a", at = {{ i, 0, 0 }} }} end
end
local p = rd.parameters(list)
for i, entry in ipairs(list) do if entry then sum = sum + p[entry[1]] end end
table.insert(links, 1, {{ "a", joint = "z, psi", mass = 2, inertia = {{ zz = 1 }} }})
table.insert(links, {{ "rod", joint = "theta", beam = {{ length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 4 }} }})
return rd.model {{ name = rd.option("name", "named"), gravity = {{ 0, 0, -9.81 }}, links = links, points = points,
  forces = function(s) return {{ a_z = force + sum * s.q.a_z }} end }}
"""


def scene(folder, words):
    path = folder / "model.lua"
    path.write_text(SCENE.format(words=", ".join(f'"{word}"' for word in words)))
    return path


def refused(path, kind, *options):
    """The names that are refused, with the reason."""
    done = refdyn("check", path, "--set", f"kind={kind}", *options, status=None)
    found = re.findall(r": (?:parameter|input|link|point) \"?([^ \"]+)\"?: (.*; choose another name)", done.stderr)
    assert len(found) == done.stderr.count("\n") - done.stderr.count("warning"), done.stderr
    return dict(found)


def compile_all(folder, compilers=COMPILERS, lead=""):
    for compiler in compilers:
        for source in some(folder.glob("*.c")):
            done = subprocess.run([*compiler, *WARNINGS, "-fsyntax-only", "-I", folder, "-I", SOURCE / "runtime", "-"], capture_output=True,
                                  text=True, input=f'{lead}#include "{source.name}"\n')
            assert done.returncode == 0, f"{' '.join(compiler)}: {done.stderr[:2000]}"


def macros(folder):
    """All macros without arguments that a compiler knows after the emitted files and the headers that callers include."""
    names = set()
    for compiler in COMPILERS:
        text = "".join(f'#include "{source.name}"\n' for source in folder.glob("*.c")) + "#include <stdio.h>\n#include <stdlib.h>\n"
        done = subprocess.run([*compiler, "-dM", "-E", "-I", folder, "-I", SOURCE / "runtime", "-"], check=True, capture_output=True,
                              text=True, input=text)
        names |= set(re.findall(r"^#define ([A-Za-z][A-Za-z0-9_]*) ", done.stdout, re.M))
    return names


def test_macros_of_other_machines_are_refused(tmp_path):
    names = set()
    for machine in MACHINES:
        for language in ("c", "c++"):
            done = subprocess.run(["clang", "-target", machine, "-x", language, "-dM", "-E", "-"], input="", capture_output=True, text=True)
            names |= set(re.findall(r"^#define ([A-Za-z][A-Za-z0-9_]*) ", done.stdout, re.M))
    assert {"linux", "mips", "sun", "WIN32"} <= names
    assert set(refused(scene(tmp_path, sorted(names)), "parameters")) == names


@pytest.fixture(scope="module")
def words(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    refdyn("gen", scene(folder, []), "-o", folder / "out")
    found = macros(folder / "out")
    assert {"M_PI", "HUGE_VAL", "NAN", "linux", "EOF", "NULL"} <= found
    return sorted((found | set(WORDS)) - {"a", "ground"})


@pytest.mark.parametrize("kind", ["parameters", "inputs", "links", "points"][::1 if LONG else 2])
def test_every_name_is_refused_or_compiles(kind, words, tmp_path):
    taken = [word for word in words if word not in refused(scene(tmp_path, words), kind)]
    assert len(taken) > 30
    path = scene(tmp_path, taken)
    assert refused(path, kind) == {}
    refdyn("gen", path, "--set", f"kind={kind}", "-o", tmp_path / "out")
    compile_all(tmp_path / "out", COMPILERS if LONG else COMPILERS[:1])
    compile_all(tmp_path / "out", lead="#include <stdio.h>\n#include <stdlib.h>\n#include <float.h>\n#include <string.h>\n")


def test_what_is_refused(words, tmp_path):
    """A member of a struct may have any name that no compiler replaces; links and points provide only parts of names."""
    path = scene(tmp_path, words)
    members, links = refused(path, "parameters"), refused(path, "links")
    assert members == refused(path, "inputs") and links == refused(path, "points")
    assert set(links) == set(links) & set(members) and not set(links) & {"M_PI", "NAN", "linux", "EOF", "size_t"}
    for word in ("sin", "t", "q", "size_t", "M", "SET", "ELEMENT_1", "complex", "I", "final", "near", "row_1", "REFDYN"):
        assert word not in members
    reasons = {"M_PIf64x": "a macro of math.h", "FP_NAN": "a macro of math.h", "EOF": "a macro of stdio.h", "LANES": "a macro of emitted files", "unix": "a macro that compilers define for some machines", "M_TWOPI": "a macro of math.h",
               "RAND_MAX": "a macro of stdlib.h, which math.h includes in C++", "co_await": "a reserved word of C or C++",
               "REFDYN_MODEL_H": "names that begin with REFDYN_ belong to the runtime", "typeof": "a reserved word of C or C++"}
    found = refused(scene(tmp_path, reasons), "parameters")
    assert found == {word: f"{why}; choose another name" for word, why in reasons.items()}


HEADERS = """
assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg stdatomic stdbool stddef stdint
stdio stdlib stdnoreturn string tgmath threads time uchar wchar wctype
aio cpio dirent dlfcn fcntl fmtmsg fnmatch ftw glob grp iconv langinfo libgen monetary mqueue ndbm netdb nl_types poll pthread pwd regex
sched search semaphore spawn strings stropts syslog tar termios trace ulimit unistd utime utmpx wordexp
""".split()


def included_headers():
    """Headers that the headers of C and POSIX include without protection of a folder."""
    found = set()
    for compiler in ["gcc", "-x", "c"], ["clang", "-x", "c"], ["g++", "-x", "c++"]:
        for header in HEADERS:
            done = subprocess.run([*compiler, "-M", "-"], input=f"#include <{header}.h>\n", capture_output=True, text=True)
            found |= set(re.findall(r"/include(?:-fixed)?/(?:[a-z0-9_]+-linux-gnu/)?(?:c\+\+/\d+/)?([A-Za-z][A-Za-z0-9_]*)\.h\b", done.stdout))
    return found


def name_fault(path, name):
    done = refdyn("check", path, "--set", f"name={name}", status=None)
    return "".join(line.split(": ", 1)[1] for line in done.stderr.splitlines() if "warning" not in line)


def test_models_hide_no_header(tmp_path):
    path = scene(tmp_path, [])
    names = included_headers() | set(HEADERS)
    assert {"features", "stdlib", "pthread"} <= names
    for name in sorted(names):
        for form in {name, name.capitalize(), name.upper()}:
            why = "a reserved word of C or C++" if form == "float" else f"{form}.h is a header of the system"
            assert name_fault(path, form) == f"model {form}: {why}; choose another name"
    assert "a header of the system" in name_fault(path, "newlib")
    for name in ("refdyn", "refdyn_model", "Refdyn_model", "REFDYN"):
        assert "names that begin with refdyn belong to the runtime" in name_fault(path, name)
    for name in ("mathematics", "stdio_", "strin", "arm", "crane", "M_PI", "linux", "main", "sin", "q", "refdy"):
        assert name_fault(path, name) == ""


def library_functions():
    names = set()
    for library in ("libc.so.6", "libm.so.6"):
        path = subprocess.run(["gcc", f"-print-file-name={library}"], check=True, capture_output=True, text=True).stdout.strip()
        symbols = subprocess.run(["nm", "-D", "--defined-only", path], check=True, capture_output=True, text=True).stdout
        names |= {line.split()[-1].split("@")[0] for line in symbols.splitlines()}
    return {name for name in names if re.match(r"[A-Za-z]", name)}


def test_models_define_no_function_of_the_library(tmp_path):
    """Every function of the library whose name is a model's name with one of the endings of the emitted files."""
    path = scene(tmp_path, ["E"])
    refdyn("gen", path, "--set", "kind=points", "--emit", "all,tangent,d_qdd,d_statics", "-o", tmp_path / "out")
    endings = set(re.findall(r"\bnamed(_\w+)\(", (tmp_path / "out" / "named.h").read_text()))
    assert {"_M", "_r", "_qdd_free", "_tangent"} <= endings
    names = {function[:-len(ending)] for function in library_functions() for ending in endings if function.endswith(ending)}
    assert {"lgamma", "strtok", "rand"} <= names
    for name in sorted(names):
        assert name_fault(path, name) == f"model {name}: {name}_r is a function of the C library; choose another name"


@pytest.mark.parametrize("name", ["M_PI", "M", "FP", "SIG", "INT", "NAN", "linux", "main", "sin", "q", "t", "x", "E", "model", "parameters",
                                  "equations", "x_Q", "I", "HUGE_VAL", "EOF", "memcpy", "size_t", "SET", "ELEMENT_1"])
def test_names_of_models_compile(name, tmp_path):
    path = scene(tmp_path, ["E"])
    refdyn("gen", path, "--set", "kind=points", "--set", f"name={name}", "-o", tmp_path / "out")
    compile_all(tmp_path / "out", COMPILERS[::2 if LONG else 4])


AWKWARD = "arm arm_z arm_psi arm_tip arm_tip_axis_x arm_z_sin E E_x constant constant_1 row_1 rod_psi_1 rod_1 t1 e_1 carry derived q_1 M_1".split()


def test_names_of_links_that_look_like_names_of_values(tmp_path):
    """A name derived from one link's name is distinguished from another link's name."""
    path = scene(tmp_path, AWKWARD)
    refdyn("gen", path, "--set", "kind=links", "--emit", "all,tangent,d_qdd", "-o", tmp_path / "out")
    compile_all(tmp_path / "out", COMPILERS[::3])
