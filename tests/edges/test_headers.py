"""The public headers together with all others, the visibility of private headers in an installation and a build, and the names of symbols."""
import re
import shutil
import subprocess

import pytest

from program import BUILD, SOURCE

RUNTIME = SOURCE / "runtime"
PUBLIC = [RUNTIME / "refdyn.h", RUNTIME / "refdyn_model.h", RUNTIME / "refdyn_lanes.h", RUNTIME / "batch" / "refdyn_batch.h",
          RUNTIME / "bindings" / "gsl" / "refdyn_gsl.h"]
CORE_ONLY = PUBLIC[:4]
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"]
COMPILERS = {"gcc C11": ["gcc", "-std=c11", "-xc"], "gcc newer C": ["gcc", "-std=gnu2x", "-xc"],
             "gcc C++17": ["g++", "-std=c++17", "-xc++"], "gcc newer C++": ["g++", "-std=gnu++20", "-xc++"],
             "clang C11": ["clang", "-std=c11", "-xc"], "clang C++17": ["clang++", "-std=c++17", "-xc++"]}
C11 = """assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg stdatomic stdbool
         stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar wchar wctype""".split()
POSIX = """aio arpa/inet curses dirent dlfcn fcntl fmtmsg fnmatch ftw glob grp iconv langinfo libgen monetary mqueue ndbm net/if netdb
           netinet/in netinet/tcp nl_types poll pthread pwd regex sched search semaphore spawn strings stropts sys/ipc sys/mman
           sys/msg sys/param sys/resource sys/select sys/sem sys/shm sys/socket sys/stat sys/statvfs sys/sysmacros sys/time sys/times
           sys/types sys/uio sys/un sys/utsname sys/wait syslog tar termios trace ulimit unistd utime utmpx wordexp""".split()
CPP17 = """algorithm any array atomic bitset charconv chrono complex condition_variable deque exception execution filesystem
           forward_list fstream functional future initializer_list iomanip ios iosfwd iostream istream iterator limits list locale map
           memory memory_resource mutex new numeric optional ostream queue random ratio regex scoped_allocator set shared_mutex
           sstream stack stdexcept streambuf string string_view system_error thread tuple type_traits typeindex typeinfo
           unordered_map unordered_set utility valarray variant vector""".split()
# Macros that other systems and libraries define: Windows, X11, old Unix, Arduino, QNX.
ELSEWHERE = ["near=", "far=", "huge=", "pascal=", "cdecl=", "interface=struct", "small=char", "hyper=long", "IN=", "OUT=", "OPTIONAL=",
             "CONST=const", "VOID=void", "ERROR=0", "STRICT=1", "DELETE=1", "min(a,b)=((a)<(b)?(a):(b))", "max(a,b)=((a)>(b)?(a):(b))",
             "linux=1", "unix=1", "i386=1", "None=0L", "Bool=int", "Status=int", "Success=0", "Always=2", "True=1", "False=0",
             "abs(x)=((x)>0?(x):-(x))", "round(x)=((long)(x))", "PI=3.14159", "F(x)=x", "B0=0", "I=1", "N=3", "T=2", "U=2", "V=1", "X=1",
             "major(x)=x", "minor(x)=x", "index=strchr", "bool=int", "complex=_Complex", "imaginary=_Imaginary", "LEFT=1", "STATUS=2"]
KEYWORDS = set("""alignas alignof and and_eq asm auto bitand bitor bool catch char16_t char32_t char8_t class co_await co_return co_yield
    compl concept consteval constexpr constinit const_cast decltype default delete dynamic_cast explicit export false friend generic
    goto import inline module mutable namespace new noexcept not not_eq nullptr operator or or_eq override private protected public
    reinterpret_cast requires restrict static_assert static_cast synchronized template this thread_local throw true try typeid typename
    typeof typeof_unqual unsigned using virtual volatile wchar_t xor xor_eq""".split())


def foreign(compiler):
    """The headers of C and the system that this compiler has, and the headers of C++: macros of the former break some of the latter."""
    groups = [[f"{name}.h" for name in (*C11, *POSIX)], CPP17 if "-xc++" in compiler else []]
    text = "".join(f"#if __has_include(<{name}>)\nfound {name}\n#endif\n" for group in groups for name in group)
    done = subprocess.run([*compiler, "-E", "-P", "-"], input=text, capture_output=True, text=True, check=True)
    found = set(re.findall(r"^found (\S+)$", done.stdout, re.M))
    assert {"complex.h", "tgmath.h", "iso646.h", "unistd.h", "sys/sysmacros.h", "termios.h"} <= found and len(found) > 70
    return [[name for name in group if name in found] for group in groups]


def check(compiler, text, *flags):
    done = subprocess.run([*compiler, *WARNINGS, *flags, "-I", RUNTIME, "-I", RUNTIME / "bindings" / "gsl", "-I", RUNTIME / "batch", "-fsyntax-only", "-"], input=text,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:3000]


def lines(headers):
    return "".join(f"#include {name}\n" for name in headers)


OURS = [f'"{path.name}"' for path in PUBLIC]
USE = "extern double refdyn_used(const struct refdyn_integrator *integrator);\n"


@pytest.mark.parametrize("name", COMPILERS)
def test_beside_all_headers_in_either_order(name):
    compiler = COMPILERS[name]
    for group in foreign(compiler):
        theirs = [f"<{header}>" for header in group]
        for text in (lines(theirs + OURS), lines(OURS[::-1] + theirs)):
            check(compiler, text + USE)


@pytest.mark.parametrize("name", COMPILERS)
def test_behind_macros_of_other_systems(name):
    """After <stddef.h>, which they include and which some of these macros break."""
    macros = [macro for macro in ELSEWHERE if not ("C++" in name and macro.startswith("bool"))]
    defines = "".join(f"#define {macro.replace('=', ' ', 1)}\n" for macro in macros)
    check(COMPILERS[name], "#include <stddef.h>\n" + defines + lines(OURS[:2]) + USE, "-Wno-keyword-macro" if "clang" in name else "-Wall")


@pytest.mark.parametrize("name", COMPILERS)
def test_each_alone_and_twice(name):
    for header in OURS:
        check(COMPILERS[name], lines([header, header]) + "extern int refdyn_used;\n")


def code(path):
    """A header without comments, string literals and include lines."""
    text = re.sub(r"/\*.*?\*/", " ", path.read_text(), flags=re.S)
    return re.sub(r'^\s*#\s*include.*$|"[^"\n]*"', "", text, flags=re.M)


def identifiers(paths):
    return {word for path in paths for word in re.findall(r"\b[A-Za-z_]\w*", code(path))}


def test_no_identifier_is_a_macro_of_another_header():
    """A macro with arguments counts only before a parenthesis, where the public headers have only functions of their own."""
    found = identifiers(PUBLIC)
    assert {"refdyn_integrator_to", "qdd", "REFDYN_OK", "is_undetermined"} <= found
    for compiler in (["gcc", "-std=gnu11", "-xc"], ["g++", "-std=gnu++17", "-xc++"]):
        macros = set()
        for group in foreign(compiler):
            done = subprocess.run([*compiler, "-D_GNU_SOURCE", "-dM", "-E", "-"], input=lines(f"<{header}>" for header in group),
                                  capture_output=True, text=True, check=True)
            macros |= set(re.findall(r"^#define (\w+)(?!\w|\()", done.stdout, re.M))
        assert len(macros) > 3000 and {"I", "SIGINT", "DBL_MAX"} <= macros and ("complex" in macros or "-xc++" in compiler)
        assert not {word for word in found & macros if not word.startswith("__")}


def test_no_identifier_is_a_word_of_a_newer_language():
    assert not identifiers(PUBLIC) & KEYWORDS


def public_names(path):
    """Macros, constants, tags, types and functions that a header defines for its includer."""
    text = code(path)
    names = set(re.findall(r"#\s*define\s+(\w+)", text))
    text = re.sub(r"^\s*#.*$", "", text, flags=re.M)
    for body in re.findall(r"\benum\b\s*\w*\s*\{([^}]*)\}", text):
        names |= set(re.findall(r"(?:^|,)\s*(\w+)", body))
    names |= set(re.findall(r"\b(?:struct|union|enum)\s+(\w+)", text)) | set(re.findall(r"\btypedef\b[^;(]*\b(\w+)\s*[(;]", text))
    outside = re.sub(r"\{[^{}]*\}", "", re.sub(r"\{[^{}]*\}", "", text.replace('extern  {', '')))
    return names | set(re.findall(r"\b(\w+)\s*\(", outside))


def test_every_public_name_begins_with_ours():
    names = set().union(*map(public_names, PUBLIC))
    assert {"REFDYN_OK", "refdyn_status", "refdyn_integrator_to", "REFDYN_H", "refdyn_function", "REFDYN_MSBDF", "REFDYN_CANDIDATES"} <= names
    foreign_names = {name for name in names if not name.startswith(("refdyn_", "REFDYN_"))}
    assert foreign_names <= {"gsl_odeiv2_system", "gsl_odeiv2_driver"}, foreign_names


# ---- What is installed ----

@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("prefix")
    subprocess.run(["cmake", "--install", BUILD, "--prefix", folder], check=True, capture_output=True)
    return folder


def has_gsl():
    return (BUILD / "librefdyn_gsl.a").exists()


def test_public_headers_alone_are_installed(prefix):
    found = {path.name for path in prefix.rglob("*") if path.suffix in (".h", ".hpp", ".c", ".def", ".inc")}
    found -= {path.name for path in (prefix / "share" / "refdyn" / "control").glob("*.c")}  # examples
    assert found == {path.name for path in (PUBLIC if has_gsl() else CORE_ONLY)}


def test_every_symbol_begins_with_ours(prefix):
    """Also names of functions that several files of the library share."""
    libraries = sorted(prefix.rglob("*.a"))
    assert len(libraries) == 2 + has_gsl()
    for library in libraries:
        text = subprocess.run(["nm", "-g", "--defined-only", library], check=True, capture_output=True, text=True).stdout
        names = [line.split()[2] for line in text.splitlines() if len(line.split()) == 3]
        assert len(names) > 5 and all(name.startswith("refdyn_") for name in names), [n for n in names if not n.startswith("refdyn_")]


# ---- Headers of a user with the names of ours ----

def private_headers():
    """Names by which a file of the source tree could replace a user's file, seen from its folder and from the one above."""
    paths = [path for path in RUNTIME.rglob("*.h") if path not in PUBLIC]
    assert len(paths) > 30
    return sorted({path.name for path in paths} | {str(path.relative_to(RUNTIME)) for path in paths})


def write_user(folder, names):
    """A program that includes its own headers of these names, and fails to compile if it gets others."""
    for index, name in enumerate(names):
        path = folder / "own" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"enum {{ OWN_{index} }};\n")
    text = "#include <refdyn.h>\n" + lines(f"<{name}>" for name in names)
    uses = "".join(f"    sum += OWN_{index};\n" for index in range(len(names)))
    (folder / "main.c").write_text(f"{text}\nint main(void) {{\n    int sum = 0;\n{uses}    return sum + !refdyn_status_text(0);\n}}\n")


USER = """cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES C)
BRING_IN
add_library(own INTERFACE)
target_include_directories(own INTERFACE own)
add_executable(user main.c)
set_target_properties(user PROPERTIES NO_SYSTEM_FROM_IMPORTED ON)
target_link_libraries(user PRIVATE refdyn::runtime own)
"""


@pytest.mark.parametrize("bring_in", ["find_package(refdyn REQUIRED)", f"set(BUILD_TESTING OFF)\nadd_subdirectory({SOURCE} refdyn)"],
                         ids=["installed", "subdirectory"])
def test_headers_of_a_cmake_user_are_found(bring_in, prefix, tmp_path):
    write_user(tmp_path, private_headers())
    (tmp_path / "CMakeLists.txt").write_text(USER.replace("BRING_IN", bring_in))
    build = tmp_path / "build"
    for command in (["cmake", "-S", tmp_path, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=Debug"],
                    ["cmake", "--build", build, "--target", "user", "-j2"], [build / "user"]):
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


def test_headers_of_a_pkg_config_user_are_found(prefix, tmp_path):
    write_user(tmp_path, private_headers())
    packages = next(prefix.rglob("refdyn.pc")).parent
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "--static", "refdyn"], check=True, capture_output=True, text=True,
                           env={"PKG_CONFIG_PATH": str(packages), "PATH": "/usr/bin:/bin"}).stdout.split()
    subprocess.run(["cc", tmp_path / "main.c", *flags, "-I", tmp_path / "own", "-o", tmp_path / "user"], check=True)
    subprocess.run([tmp_path / "user"], check=True)


def test_headers_of_who_takes_the_sources_are_found(tmp_path):
    """With the folder `runtime` itself on the path, as in the examples."""
    write_user(tmp_path, [name for name in private_headers() if "/" not in name])
    subprocess.run(["cc", "-fsyntax-only", "-I", RUNTIME, "-I", tmp_path / "own", tmp_path / "main.c"], check=True)


def test_headers_of_who_copies_the_sources(tmp_path):
    """The folder `runtime` compiles wherever it lies, with itself and the folder that it lies in as the only paths."""
    shutil.copytree(RUNTIME, tmp_path / "copied" / "runtime", ignore=shutil.ignore_patterns("tool", "gsl", "python"))
    sources = sorted((tmp_path / "copied").rglob("*.c"))
    assert len(sources) > 25
    for source in sources:
        subprocess.run(["cc", "-std=c11", *WARNINGS, "-I", tmp_path / "copied", "-I", tmp_path / "copied" / "runtime", "-fsyntax-only", source], check=True, cwd=tmp_path)
