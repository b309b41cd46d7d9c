"""Names in the emitted C are true: no value has the name of a body, an element, a row or a constant to which it does not belong.

Equal expressions are computed once and have one name, so a name must be true for all owners of the value.
"""
import re

import pytest

from program import REFERENCE, TESTS, all_models, refdyn

MODELS = [(path, []) for path in all_models() + sorted((TESTS / "models").glob("*.lua"))]
MODELS += [(REFERENCE, ["--set", f"n_rfe={rfe}", "--emit", emit]) for rfe in (1, 2, 16) for emit in ("all", "all,tangent,d_qdd")]
OWN = re.compile(r"mass|moment_[xyz]|inertia_[xyz]{2}")
INLINE = re.compile(r"(?:p->(?:derived\.)?)?(?!constant_|t\d)([a-zA-Z]\w*) [-+*/] (?:p->(?:derived\.)?)?(?!constant_|t\d)([a-zA-Z]\w*)")


def name_of(scene):
    return " ".join([scene[0].stem, *(word for word in scene[1] if not word.startswith("--"))])


@pytest.fixture(scope="module", params=MODELS, ids=name_of)
def emitted(request, tmp_path_factory):
    """Text of the sources with continued lines joined; names of coordinates, and for each of them its carriers and itself."""
    folder = tmp_path_factory.mktemp("emitted")
    refdyn("gen", request.param[0], *request.param[1], "-o", folder)
    text = "".join(path.read_text() for path in sorted(folder.glob("*.c")))
    header = next(folder.glob("*.h")).read_text()
    parents = [int(word) for word in re.search(r"_parent\[\] = \{([^}]*)\}", text).group(1).split(",")]
    table = text[text.index("_coordinate_names[] = {"):text.index("_parameter_names[]") if "_parameter_names[]" in text else None]
    macros = dict(re.findall(r"#define (ELEMENT_\d+)\(e\) (.*)", text))
    names = []
    for macro, number, name in re.findall(r'(ELEMENT_\d+)\((\d+)\)|\{"(\w+)", ', table[:table.index("\n};")]):
        names += [stem + number for stem in re.findall(r'\{"(\w+)" #e', macros[macro])] if macro else [name]
    assert len(names) == len(parents) and f"{len(names)} coordinates" in header
    carriers = []
    for i, parent in enumerate(parents):
        carriers.append({i} | (carriers[parent] if parent >= 0 else set()))
    return re.sub(r"(?<![;{}/])\n\s+(?=\S)", " ", text), names, carriers


def statements(text):
    """Target and expression of each assignment."""
    return re.findall(r"^ *(?:const double )?([\w>.\[\]*+ -]+?) = (.*);$", text, re.M)


class Owners:
    """The frame to which a name belongs: arm_psi_2_sin to that of arm_psi_2, arm_psi_e_sin to the frames of all elements."""

    def __init__(self, names):
        self.coordinates = {name: [i] for i, name in enumerate(names)}
        for i, name in enumerate(names):
            if re.search(r"_\d+$", name):
                self.coordinates.setdefault(re.sub(r"\d+$", "e", name), []).append(i)
        known = "|".join(sorted(map(re.escape, self.coordinates), key=len, reverse=True))
        self.pattern = re.compile(rf"(?:last_|next_)?({known})_(\w+?)(?:_\d+)?$")

    def of(self, name):
        match = self.pattern.match(name)
        return (self.coordinates[match.group(1)], match.group(2)) if match else (None, "")


def test_bodies(emitted):
    """A value named after a frame depends only on frames on the way to the ground or beyond it; a body's own inertia counts only for its
    carriers."""
    text, names, carriers = emitted
    owners = Owners(names)
    seen = 0
    for target, expression in statements(text):
        entry = re.fullmatch(r"(?:out->)?M\[(\d+) \* \d+ \+ (\d+)\]", target)
        name = target.split("derived.")[-1]
        mine = [max(map(int, entry.groups()))] if entry else owners.of(name)[0]
        if not mine or re.search(r"_(plus|minus|times|over|inverse)\b|_(plus|minus|times|over)_", name):
            continue
        for used in set(re.findall(r"[a-zA-Z_]\w*", expression)):
            theirs, what = owners.of(used)
            seen += theirs is not None
            assert not theirs or any(i in carriers[j] or j in carriers[i] for i in mine for j in theirs), f"{target} = {expression}: {used}"
            if theirs and OWN.fullmatch(what):
                assert any(i in carriers[j] for i in mine for j in theirs), f"{target} = {expression}: {used}"
    assert seen > 50 or "effector_z" not in names, "of the reference manipulator many are read"


def test_rows(emitted):
    """The value of a row, or of a point, is not named after another row."""
    text, names, _ = emitted
    for target, expression in statements(text):
        result = re.match(r"(?:out->)?(phi|psi|v|k|u|C|r|rd|d)\[(\d+)( \+)?", target)
        if not result:
            continue
        row = int(result.group(2)) // (len(names) if result.group(3) else 1) + 1  # u[16 + 3 * e] is one index
        for number in re.findall(r"\brow_(\d+)_", expression):
            assert result.group(1) in ("phi", "psi", "v", "k", "u") and int(number) == row, f"{target} = {expression}"


def test_constants(emitted):
    """constant_7 has no short name: it is never one operation on two named values."""
    for target, expression in statements(emitted[0]):
        inline = INLINE.fullmatch(expression) if "derived.constant_" in target else None
        assert not inline or len("".join(inline.groups())) > 40, f"{target} = {expression}"
