"""Who may include which headers, and what no file of ours may contain."""
import re

from program import CORE_FILES, SOURCE, sources

GENERATOR_FILES, TOOL_FILES = sources("gen", "*.[ch]", "*.def"), sources("runtime/tool")


def headers(files):
    names = {path.name for path in files if path.suffix == ".h"}
    assert names
    return names


CORE_HEADERS = headers(CORE_FILES)


def includes(files):
    """(file, included name) of every include line."""
    found = [(path, match.group(1)) for path in files
             for match in re.finditer(r'^\s*#\s*include\s*["<]([^">]+)[">]', path.read_text(), re.M)]
    assert found
    return found


def test_only_the_files_of_the_script_know_lua():
    known = {f"gen/script/{name}" for name in ("script_state.h", "script.c", "script_value.c", "script_metatable.c", "script_library.c",
                                           "script_kinds.c", "script_derive.c")}
    users = {str(path.relative_to(SOURCE)) for path, name in includes(GENERATOR_FILES + CORE_FILES + TOOL_FILES)
             if name.split("/")[-1] in ("lua.h", "lualib.h", "lauxlib.h", "lua.hpp", "script_state.h")}
    assert users == known


def test_generator_includes_no_runtime():
    """Except for the header that emitted code and its callers share."""
    runtime = (CORE_HEADERS | headers(TOOL_FILES)) - {"refdyn_model.h", "refdyn_lanes.h", "chain_cost.h"}
    wrong = [(path.name, name) for path, name in includes(GENERATOR_FILES)
             if name.split("/")[-1] in runtime and SOURCE / name not in GENERATOR_FILES]
    assert not wrong


def test_runtime_core_stands_alone():
    """Only its own headers and those of C11: no generator, no Lua, no library, no POSIX."""
    standard = {"assert.h", "complex.h", "ctype.h", "errno.h", "fenv.h", "float.h", "inttypes.h", "limits.h", "math.h", "setjmp.h",
                "stdalign.h", "stdarg.h", "stdatomic.h", "stdbool.h", "stddef.h", "stdint.h", "stdlib.h", "string.h", "tgmath.h"}
    wrong = [(path.name, name) for path, name in includes(CORE_FILES)
             if name not in standard and not any((root / name).resolve() in CORE_FILES for root in (SOURCE, SOURCE / "runtime"))]
    assert not wrong


def test_only_the_tool_includes_both():
    users = {name.split("/")[-1] for _, name in includes(TOOL_FILES)}
    assert users & headers(GENERATOR_FILES) and users & CORE_HEADERS


def code(path):
    """A C file without comments and texts."""
    text = re.sub(r'"(\\.|[^"\\\n])*"', '""', path.read_text())
    return re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)


def test_runtime_core_is_quiet():
    """The core never prints, exits or allocates."""
    for path in CORE_FILES:
        calls = re.findall(r"\b(printf|fprintf|puts|perror|exit|abort|malloc|calloc|realloc|free)\s*\(", code(path))
        assert not calls, f"{path.name} calls {sorted(set(calls))}"


def changing_variable(line):
    """Whether a line at file scope defines a variable that may change (also a pointer to constants)."""
    declared = re.match(r"(?!typedef|extern|return|goto|else|#)([A-Za-z_][\w\s*]*\w(\[[^\]]*\])*)\s*(=[^=]|;)", line)
    if not declared or re.match(r"(struct|enum|union)\s+\w+\s*;", line):
        return False
    return "const" not in re.sub(r"\[[^\]]*\]", "", declared.group(1)).split("*")[-1]


def test_changing_variables_are_seen():
    changing = ["static int counter;", "int x = 3;", "static double t[3] = {", "static const char *name;", "static char **list = NULL;"]
    constant = ["struct point;", "const double x = 1;", "static const double a[4 * 4] = {", "static const char *const names[] = {", "};", "void f(int a);"]
    assert all(map(changing_variable, changing)) and not any(map(changing_variable, constant))


def test_no_state_outside_functions():
    """In the generator, the runtime core and the emitted code."""
    for path in GENERATOR_FILES + CORE_FILES + sources("generated"):
        found = [line for line in code(path).splitlines() if path.suffix == ".c" and changing_variable(line)]
        assert not found, f"{path.name}: {found}"


def test_no_path_of_a_machine():
    for folder in ("gen", "runtime", "models", "generated", "tests"):
        for path in sources(folder, *("*" + suffix for suffix in (".c", ".h", ".lua", ".md", ".py", ".cmake"))):
            found = re.findall(r"(?<![\w.])/(?:home|root|work)/\w+", path.read_text())
            assert not found, f"{path}: {found}"


def test_options_of_commands_are_declared():
    """The program reads options by name: each name has a rule of a fitting kind, and each rule a command that lists it."""
    text = "".join(path.read_text() for path in TOOL_FILES if path.suffix == ".c")
    tables = re.findall(r"struct option_rule \w+\[\] = \{(.*?)\{\.name = NULL\}\}", text, re.S)
    kinds = {name: kind for table in tables for name, kind in re.findall(r'\{"([\w-]+)",\s*(?:"[^"]*"|NULL),\s*OPTION_(\w+)', table)}
    listed = {name.rstrip("!") for texts in re.findall(r'\.options = ((?:"[^"]*"\s*)+)', text) for name in "".join(re.findall('"([^"]*)"', texts)).split()}
    assert len(kinds) > 60 and listed == kinds.keys() - {"help"}
    fitting = {"text": {"TEXT", "LIST", "FREEING_LIST"}, "number": {"POSITIVE", "COUNT", "INDEX"}, "repeated": {"TEXTS"}, "choose": {"TEXT"}, "is": {"TEXT"},
               "has": set(kinds.values())}
    reads = re.findall(r'options_(?:set_)?(has|text|number|repeated|choose|is)\([^,"]+,\s*"([^"]+)"', text)
    assert len(reads) > 100 and not [(how, name) for how, name in reads if kinds.get(name) not in fitting[how]]
