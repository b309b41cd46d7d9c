"""Random models as data, and the same models as Lua. Equal seeds produce equal models.

Formulas are texts that Lua and, with ** for ^, Python read alike. Forces without an energy vanish at t = 0 and at rest.
"""
import random
import re

KINDS = ["x", "y", "z", "phi", "theta", "psi"]
TURNS = ("psi", "theta", "phi")


class Tagged:
    """rd.tag { items, fields }, or rd.tag(items) if no field is named and the tag is a section's."""

    def __init__(self, tag, *items, **fields):
        self.tag, self.items, self.fields = tag, items, fields

    def __getitem__(self, name):
        return self.fields[name]

    def __contains__(self, name):
        return name in self.fields

    def get(self, name, default=None):
        return self.fields.get(name, default)


class Formula(str):
    """A text that is copied to Lua unchanged."""


class Parameter(float):
    """A number that is a parameter of the model."""


def value(rng, low, high):
    number = round(rng.uniform(low, high), 6)
    return Parameter(number) if rng.random() < 0.15 else number


def vector(rng, size):
    return tuple(value(rng, -size, size) for _ in range(3))


def some(rng, chance, make):
    return make() if rng.random() < chance else None


def filled(**fields):
    return {name: entry for name, entry in fields.items() if entry is not None}


# ---- bodies and beams ----

def turning(rng):
    angle = rng.choice([round(rng.uniform(-2, 2), 6), Formula("rd.pi/2"), value(rng, -2, 2)])
    return [(rng.choice("xyz"), angle) for _ in range(rng.randint(1, 2))]


def solid(rng):
    """Mass, centre and tensor of four random point masses: a possible body with products of inertia."""
    parts = [(rng.uniform(0.2, 2), [rng.uniform(-0.4, 0.4) for _ in range(3)]) for _ in range(4)]
    mass = sum(m for m, _ in parts)
    center = [sum(m * r[i] for m, r in parts) / mass for i in range(3)]
    tensor = dict.fromkeys(("xx", "yy", "zz", "xy", "xz", "yz"), 0.0)
    for m, r in parts:
        x, y, z = (r[i] - center[i] for i in range(3))
        for name, entry in zip(tensor, (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)):
            tensor[name] += m * entry
    return {"mass": mass, "center": tuple(center), "inertia": tensor}


def shape(rng):
    tag = rng.choice(["box", "cylinder", "tube", "sphere"])
    fields = {"density": value(rng, 500, 3000)} if rng.random() < 0.6 else {"mass": value(rng, 0.5, 3)}
    if rng.random() < 0.7:
        fields["at"] = vector(rng, 0.4)
    if rng.random() < 0.5:
        fields["turn"] = turning(rng)
    if tag in ("cylinder", "tube"):
        fields["length"] = value(rng, 0.1, 0.5)
        if rng.random() < 0.6:
            fields["axis"] = rng.choice("xyz")
    if tag == "box":
        return Tagged(tag, size=tuple(value(rng, 0.05, 0.3) for _ in range(3)), **fields)
    if tag == "tube":
        return Tagged(tag, outer=value(rng, 0.1, 0.2), inner=value(rng, 0.02, 0.09), **fields)
    return Tagged(tag, diameter=value(rng, 0.05, 0.2), **fields)


def massive(rng):
    """Fields of a link whose mass has an inertia about every axis."""
    if rng.random() < 0.6:
        return solid(rng)
    bodies = [shape(rng) for _ in range(rng.randint(1, 3))]
    if rng.random() < 0.5:
        bodies.append({**solid(rng), "at": vector(rng, 0.3), "turn": turning(rng)})
    return {"bodies": bodies, **(solid(rng) if rng.random() < 0.3 else {})}


def section(rng):
    tag = rng.choice(["round", "tube", "rectangle", None])
    if tag == "round":
        return Tagged(tag, value(rng, 0.01, 0.03))
    if tag == "tube":
        return Tagged(tag, value(rng, 0.02, 0.03), value(rng, 0.005, 0.015))
    if tag == "rectangle":
        return Tagged(tag, value(rng, 0.01, 0.03), value(rng, 0.01, 0.03))
    return {"area": value(rng, 1e-4, 4e-4), "Iy": 1.25e-8, "Iz": 2.5e-9, "It": 3.75e-9}


def damping(rng, dofs, single):
    kinds = rng.sample(dofs, rng.randint(1, len(dofs)))
    fields = {kind: value(rng, 0.1, 2) for kind in kinds}
    way = rng.choice(["given", "mode", "frequency"])
    if way == "frequency" or (way == "mode" and not single):
        fields.update(ratio=value(rng, 0.01, 0.1), frequency=value(rng, 1, 20))
    elif way == "mode":
        fields.update(ratio=value(rng, 0.01, 0.1), mode=rng.randint(1, 3), **({"tip_mass": 0.5} if rng.random() < 0.5 else {}))
    return fields


def stiffening(rng, dofs, single):
    """Damping and curvature of a beam or segment."""
    fields = rng.choice([{}, {"eta": value(rng, 1e-3, 3e-3)}, {"damping": damping(rng, dofs, single)}])
    if rng.random() < 0.4:
        fields = {**fields, "curvature": {kind: value(rng, -0.5, 0.5) for kind in dofs}}
    return fields


def beam(rng, few):
    dofs = [kind for kind in TURNS if rng.random() < 0.5] if few else list(TURNS)
    dofs = dofs or ["psi"]
    common = {"section": section(rng), "E": 2.1e9, "nu": 0.31, "rho": value(rng, 1000, 3000), "rfe": rng.choice([1, 2, 2, 3])}
    if len(dofs) < 3 or rng.random() < 0.3:
        common["dofs"] = tuple(dofs)
    single = rng.random() < 0.5
    common.update(stiffening(rng, dofs, single))
    if single:
        return {"length": value(rng, 0.8, 2), **common}
    segments = []
    for _ in range(rng.randint(2, 3)):
        segment = {"length": value(rng, 0.3, 0.8)}
        if rng.random() < 0.4:
            segment["section"] = section(rng)
        if rng.random() < 0.4:
            segment["rfe"] = rng.choice([1, 2])
        if rng.random() < 0.2:
            segment.update(E=1.5e9, nu=0.25, rho=1400)
        segments.append(segment)
    return {"segments": segments, **common}


def beam_length(data):
    return sum(part["length"] for part in data.get("segments", [data]))


# ---- links ----

def at_random(rng, kinds):
    """Springs and dampers of some joints."""
    fields = {}
    for kind in kinds:
        if rng.random() < 0.5:
            fields.setdefault("spring", {})[kind] = value(rng, 1, 50)
            if rng.random() < 0.5:
                fields.setdefault("rest", {})[kind] = value(rng, -0.3, 0.3)
        if rng.random() < 0.4:
            fields.setdefault("damper", {})[kind] = value(rng, 0.1, 5)
        if rng.random() < 0.3:
            fields.setdefault("start", {})[kind] = value(rng, -0.3, 0.3)
    return fields


def jointed(rng, name, kinds, **fields):
    return {"name": name, **filled(**fields), "joint": list(kinds), **at_random(rng, kinds)}


def placing(rng, size=0.6):
    return filled(at=some(rng, 0.8, lambda: vector(rng, size)), turn=some(rng, 0.5, lambda: turning(rng)))


WAYS = ("one link", "links", "euler", "two", "apart", "turned", "child", "weight", "slide")


def add_ball(rng, links, on, name, way):
    """Turns at one point: three in one link or in several links, which are eliminated together, and similar cases that are not."""
    axes = rng.sample(["psi", "theta", "phi"], 3)
    if way == "one link":
        links.append(jointed(rng, name, axes, on=on, **placing(rng), **massive(rng)))
    elif way == "slide":
        kinds = [rng.choice("xyz")] + axes
        links.append(jointed(rng, name, kinds, on=on, **placing(rng), **massive(rng)))
    elif way == "two":
        links.append(jointed(rng, name, axes[:2], on=on, **placing(rng), **massive(rng)))
    else:
        third = axes[0] if way == "euler" else axes[2]
        split = rng.randint(1, 2)
        first = jointed(rng, name + "a", axes[:split], on=on, **placing(rng))
        second = jointed(rng, name + "b", axes[split:2] if split == 1 else [third], on=name + "a")
        parts = [first, second]
        if split == 1:
            parts.append(jointed(rng, name + "c", [third], on=name + "b"))
        parts[-1].update(massive(rng))
        if way == "apart":
            parts[1]["at"] = vector(rng, 0.2)
        elif way == "turned":
            parts[1]["turn"] = [(rng.choice("xyz"), value(rng, -0.6, 0.6))]
        elif way == "child":
            parts.append(jointed(rng, name + "d", [rng.choice(KINDS)], on=name + "a", **massive(rng)))
        elif way == "weight":
            parts[0].update(solid(rng))
        links += parts
        return parts[-1]["name"] if way != "child" else parts[-2]["name"]
    return name


def add_beam(rng, links, on, few):
    data = beam(rng, few)
    fields = solid(rng) if rng.random() < 0.3 else {}
    rod = jointed(rng, "rod", rng.choice([["theta"], ["psi"], [], ["phi", "psi"]]), on=on, **placing(rng, 0.3), **fields)
    links.append({**rod, "beam": data})
    links.append(jointed(rng, "load", rng.choice([["x"], [], ["psi", "theta", "phi"]]), on="rod.tip", **placing(rng, 0.2), **massive(rng)))
    if rng.random() < 0.6:
        place = filled(on="rod", along=round(rng.uniform(0.05, 0.95) * beam_length(data), 6), **placing(rng, 0.1))
        links.append(jointed(rng, "rider", rng.choice([["x"], [], ["theta"]]), **place, **massive(rng)))


def random_links(rng, few):
    links, carriers, ways = [], [], []
    if rng.random() < 0.2:
        links.append(jointed(rng, "base", ["free"], **massive(rng)))
        links[-1] = {name: entry for name, entry in links[-1].items() if name not in ("spring", "rest", "damper", "start")}
        carriers.append("base")
    for number in range(rng.randint(1, 2 if few else 3)):
        on = rng.choice(carriers) if carriers and rng.random() < 0.85 else None
        if rng.random() < 0.45:
            ways.append(rng.choice(WAYS[:2] + WAYS))
            carriers.append(add_ball(rng, links, on, f"part{number}", ways[-1]))
        else:
            kinds = rng.sample(KINDS, rng.randint(0 if number else 1, 2))
            links.append(jointed(rng, f"part{number}", kinds, on=on, **placing(rng), **massive(rng)))
            carriers.append(f"part{number}")
    if rng.random() < 0.6:
        add_beam(rng, links, rng.choice(carriers), few)
    return links, ways


# ---- runs of equal elements ----

def equal_links(rng, name, on):
    """A chain of links that differ only in their names."""
    kinds = rng.sample(KINDS, rng.choice([1, 1, 2, 3]))
    given = {**at_random(rng, kinds), **(massive(rng) if rng.random() < 0.8 else solid(rng))}
    place = placing(rng)
    chain = []
    for number in range(1, rng.randint(2, 8 if len(kinds) == 1 else 5) + 1):
        chain.append({"name": f"{name}_{number}", **filled(on=on), **place, "joint": kinds, **given})
        on = chain[-1]["name"]
    if rng.random() < 0.3:
        chain[0] = {**chain[0], **placing(rng)}
    return chain


def long_beam(rng, most):
    """A beam of many elements, of approximately the given number."""
    dofs = rng.choice([("psi",), ("theta",), ("psi", "theta"), ("theta", "phi"), TURNS, TURNS])
    common = {"section": section(rng), "E": 2.1e9, "nu": 0.31, "rho": value(rng, 1000, 3000), "rfe": rng.randint(2, most)}
    if len(dofs) < 3:
        common["dofs"] = dofs
    single = rng.random() < 0.65
    common.update(stiffening(rng, list(dofs), single))
    if single:
        return {"length": value(rng, 0.8, 2), **common}
    segments = [{"length": value(rng, 0.3, 0.8)} for _ in range(rng.randint(2, 3))]
    for segment in segments:
        segment["rfe"] = rng.randint(1, max(2, most // 2 + 1))
        if rng.random() < 0.4:
            segment["section"] = section(rng)
        if rng.random() < 0.3 and not {"eta", "damping"} & set(common):
            segment.update(stiffening(rng, list(dofs), False))
    return {"segments": segments, **common}


def add_long_beam(rng, links, on, name, most):
    """Adds a beam on `on` with loads in the middle and at its tip; returns the names of all possible carriers."""
    rod = jointed(rng, name, rng.choice([["theta"], ["psi"], [], [], ["phi", "psi"]]), **filled(on=on), **placing(rng, 0.3),
                  **(solid(rng) if rng.random() < 0.2 else {}))
    rod["beam"] = long_beam(rng, most)
    links.append(rod)
    carriers = [name + ".tip"]
    for number in range(rng.choice([0, 1, 1, 2])):
        links.append(jointed(rng, f"{name}_load{number}", rng.choice([["x"], [], ["psi"]]), on=name + ".tip", **placing(rng, 0.2), **massive(rng)))
        carriers.append(links[-1]["name"])
    if rng.random() < 0.3:
        place = filled(on=name, along=round(rng.uniform(0.05, 0.95) * beam_length(rod["beam"]), 6), **placing(rng, 0.1))
        links.append(jointed(rng, name + "_rider", rng.choice([["x"], [], ["theta"]]), **place, **massive(rng)))
    return carriers


def interleaved(rng, links):
    """The same links in another order, each carrier before the links that it carries."""
    left, placed, result = list(links), set(), []
    while left:
        ready = [link for link in left if "on" not in link or link["on"].split(".")[0] in placed]
        result.append(rng.choice(ready) if rng.random() < 0.5 else ready[0])
        placed.add(result[-1]["name"])
        left = [link for link in left if link is not result[-1]]
    return result


def run_links(rng, most):
    """Beams of many elements and chains of equal links, in series or in parallel."""
    links, carriers = [], [None]
    if rng.random() < 0.15:
        links.append(jointed(rng, "base", ["free"], **massive(rng)))
        links[-1] = {name: entry for name, entry in links[-1].items() if name not in ("spring", "rest", "damper", "start")}
        carriers = ["base"]
    for number in range(rng.randint(1, 3)):
        on, kind = rng.choice(carriers[-3:]), rng.random()
        if kind < 0.25:
            kinds = rng.sample(KINDS, rng.randint(1, 2))
            links.append(jointed(rng, f"part{number}", kinds, **filled(on=on), **placing(rng), **massive(rng)))
            carriers.append(f"part{number}")
        elif kind < 0.5:
            links += equal_links(rng, f"chain{number}", on)
            carriers += [link["name"] for link in links[-2:]]
        else:
            carriers += add_long_beam(rng, links, on, f"rod{number}", most)
    return (interleaved(rng, links) if rng.random() < 0.3 else links), []


# ---- what the model says of its state ----

def beam_names(links):
    return [link["name"] for link in links if "beam" in link]


class Scene:
    """Names and places of a random model's links, to choose from."""

    def __init__(self, rng, links):
        self.rng, self.links = rng, links
        self.coordinates = coordinate_names(links)
        self.beams = {link["name"]: beam_length(link["beam"]) for link in links if "beam" in link}
        movable = [link["name"] for link in links if path_coordinates(links, link["name"])]
        self.names = movable + [name + ".tip" for name in self.beams if name in movable]

    def coordinate(self):
        return self.rng.choice(self.coordinates)

    def name_few(self):
        """Leaves most elements without names and points, which would exclude them from runs."""
        own = [name for name in self.coordinates if not re.search(r"_\d+$|^chain", name)]
        chosen = set(self.rng.sample(self.coordinates, min(2, len(self.coordinates))) + self.rng.sample(own, min(3, len(own))))
        self.coordinates = [name for name in self.coordinates if name in chosen]
        self.beams = {name: length for name, length in self.beams.items() if self.rng.random() < 0.3}
        self.names += [name + ".tip" for name in beam_names(self.links) if name + ".tip" not in self.names]
        self.names = [name for name in self.names if name == self.names[-1] or not re.match(r"chain\d_", name) or self.rng.random() < 0.3]

    def place(self, on=None):
        rng, on = self.rng, on or self.rng.choice(self.names + ["ground"])
        if rng.random() < 0.2:
            return on
        fields = {"on": on}
        if on in self.beams and rng.random() < 0.6:
            fields["along"] = round(rng.uniform(0.02, 0.98) * self.beams[on], 6)
        return {**fields, **filled(at=vector(rng, 0.5), turn=some(rng, 0.3, lambda: turning(rng)))}

    def two_names(self):
        """Two carriers that move relative to each other."""
        first = self.rng.choice(self.names)
        paths = {name: path_coordinates(self.links, name) for name in self.names + ["ground"]}
        return first, self.rng.choice([name for name in paths if paths[name] != paths[first]])

    def two_places(self):
        first, second = self.two_names()
        return [self.place(first), self.place(second)]

    def axis(self, on):
        rng = self.rng
        direction = rng.choice(["x", "y", "z", vector(rng, 1)])
        return {"on": on, **filled(at=some(rng, 0.7, lambda: vector(rng, 0.4)), turn=some(rng, 0.3, lambda: turning(rng))),
                "direction": direction}

    def two_axes(self):
        return [self.axis(name) for name in self.two_names()]


def path_coordinates(links, name):
    """Coordinates between a place and the ground, with beams as a whole."""
    by_name = {link["name"]: link for link in links}
    link = by_name.get(name.split(".")[0])
    if not link:
        return ()
    own = coordinate_names([{**link, "beam": {"length": 1, "rfe": 1}} if "beam" in link and ".tip" not in name else link])
    on = link.get("on", "ground")
    return path_coordinates(links, on + (".tip" if "along" in link else "")) + tuple(own)


def torque(rng, scene):
    """A torque against another link or the ground; against its own link it would have no effect and be refused."""
    name = rng.choice(scene.names)
    place, value, follows = scene.place(name), load(rng, scene), axes(rng, scene)
    against = some(rng, 0.4, lambda: rng.choice(scene.names))
    return Tagged("torque", place, value, **follows, **filled(against=None if against == name else against))


def force_list(rng, scene, few):
    a, b, c = (scene.coordinate() for _ in range(3))
    makers = [
        lambda: Tagged("spring", *scene.two_places(), stiffness=value(rng, 5, 80), **filled(rest=some(rng, 0.6, lambda: value(rng, 0.1, 0.6)))),
        lambda: Tagged("damper", *scene.two_places(), damping=value(rng, 0.5, 3)),
        lambda: Tagged("actuator", *scene.two_places(), Formula(f"rd.sin(2*s.t)*(3 + s.q.{a}) - s.qd.{b}")),
        lambda: Tagged("force", scene.place(rng.choice(scene.names)), load(rng, scene), **axes(rng, scene)),
        lambda: torque(rng, scene),
        lambda: Tagged("energy", Formula(f"2.5*rd.cos(s.q.{a} - 0.3)*(s.points.E.z - s.q.{b})^2 + s.points.F.x*s.q.{c}")),
    ]
    return [rng.choice(makers)() for _ in range(rng.randint(0, 2 if few else 4))]


def load(rng, scene):
    a, b = scene.coordinate(), scene.coordinate()
    choices = ["0", f"3.5*rd.sin({value(rng, 0.5, 2)}*s.t)", f"rd.sin(s.t)*s.q.{a}*2 - s.qd.{b}", "s.points.E.zd*s.points.F.x - 0.5*s.points.E.xd",
               f"rd.friction(2, s.qd.{a}, 0.5)", "rd.sin(s.t)*(s.points.E.x - s.points.F.y^2)"]
    return tuple(Formula(rng.choice(choices)) for _ in range(3))


def axes(rng, scene):
    return filled(axes=some(rng, 0.5, lambda: rng.choice(scene.names + ["E"])))


def coordinate_forces(rng, scene):
    a, b, c = (scene.coordinate() for _ in range(3))
    texts = [f"rd.sin(2*s.t)*s.q.{b} - 0.25*s.qd.{a}*s.q.{b}^2", f"rd.where(rd.less(s.q.{b}, 0.1), rd.sin(s.t), 2)*rd.tanh(s.qd.{a})",
             "rd.ramp(s.t, 0, 1.5)*1.75 + rd.smoothstep(s.t, 0.5, 4)", f"rd.max(s.qd.{a}, s.qd.{b})*rd.exp(-rd.abs(s.q.{c}))",
             f"s.inputs.u*rd.sin(s.t)*rd.sqrt(2 + s.q.{b})", f"rd.atan2(s.qd.{a}, 2 + s.points.E.x^2)", "rd.sin(s.t)*course(s.t)"]
    return {name: Formula(rng.choice(texts)) for name in sorted({a, b})[:rng.randint(0, 2)]}


def written_row(rng, scene, level):
    a, b = scene.coordinate(), scene.coordinate()
    texts = {
        "position": [f"(E.x - 0.3)^2/4 + E.y*E.z - 0.7*rd.sin(1.5*s.t) + rd.cos(s.q.{a})/5 + F.z", "F.x*E.y - course(s.t) + E.z",
                     f"rd.asin(s.q.{a}/5) + rd.acos(E.x/9)*rd.tan(s.q.{b}/3) + rd.sinh(E.y/4)*rd.cosh(s.q.{a}) + rd.log(3 + F.z^2)",
                     f"rd.pow(2 + E.z^2, 0.75) - rd.atan(F.x)*rd.min(E.x, 9 + E.y) + E.x^3 + 2^s.q.{b} - rd.atan2(E.y, 9)*rd.pi",
                     f"E.axes.x.x*F.axes.z.y + E.x - 0.25*s.t + s.q.{b}", f"rd.sqrt((E.x - F.x)^2 + 1) + rd.exp(s.q.{a}*E.z) - 2"],
        "velocity": [f"E.xd*E.y - 0.4*E.z*s.t + 0.3*s.qd.{b}^2 + E.zd", f"rd.sqrt(1 + E.xd^2 + F.zd^2) - course(s.t) + s.qd.{a}*s.qd.{b}",
                     f"E.axes.y.xd + E.zd*s.qd.{a} + F.xd", f"rd.sin(s.qd.{a})*E.x + s.qd.{b}*F.yd - rd.cos(s.t)"],
        "acceleration": [f"E.ydd*(1 + E.x^2) + s.qdd.{a}*s.t - E.xd*E.zd", f"s.qdd.{a}*rd.cos(s.q.{b}) + E.axes.z.xdd + F.zdd + s.qd.{b}^3",
                         f"2*s.qdd.{b} + 0.5*E.zdd - s.qd.{a}*F.xd + rd.sin(s.t)"],
    }[level]
    text = rng.choice(texts)
    for name in ("E", "F"):
        text = text.replace(f"{name}.", f"s.points.{name}.")
    gains = {"position": ["alpha", "beta"], "velocity": ["alpha"], "acceleration": []}[level]
    return Tagged(level, Formula(text), **{gain: value(rng, 0.5, 4) for gain in gains if rng.random() < 0.8})


def closing(rng):
    return rng.choice([["weld"], ["ball"], ["x"], ["psi"], ["theta", "phi"], ["phi", "theta", "psi"], ["x", "z"], ["y", "theta"],
                       ["x", "y", "psi"], ["z", "phi", "psi"]])


def one_row(rng, scene, free, way=None):
    """One entry of constraints; `free`: coordinates without a drive so far."""
    gains = {gain: value(rng, 0.5, 4) for gain in ("alpha", "beta") if rng.random() < 0.7}
    ways = ["position", "velocity", "acceleration"] * 3 + ["loop"] * 2
    ways += ["parallel", "perpendicular", "on_line", "on_plane", "distance"] + ["drive", "lock"] * bool(free)
    way = way or rng.choice(ways)
    if way in ("position", "velocity", "acceleration"):
        return written_row(rng, scene, way)
    if way == "loop":
        return Tagged(way, *scene.two_places(), **filled(keep=some(rng, 0.6, lambda: sorted(rng.sample("xyz", rng.randint(1, 2))))), **gains)
    if way in ("parallel", "perpendicular"):
        return Tagged(way, *scene.two_axes(), **gains)
    if way in ("on_line", "on_plane"):
        a, b = scene.two_names()
        return Tagged(way, scene.place(a), scene.axis(b), **gains)
    if way == "distance":
        return Tagged(way, *scene.two_places(), rng.choice([0.75, Formula("0.5 + 0.25*rd.sin(s.t)")]), **gains)
    if way == "close":
        return Tagged(way, *scene.two_places(), joint=closing(rng), **gains)
    name = free.pop(rng.randrange(len(free)))
    if way == "drive":
        return Tagged(way, name, Formula(rng.choice(["0.3*rd.sin(2*s.t)", "course(s.t) - 0.1*s.t^2", "rd.smoothstep(s.t, 0.5, 4)"])), **gains)
    return Tagged(way, name, *([value(rng, -0.5, 0.5)] if rng.random() < 0.5 else []), **gains)


def row_count(entry):
    from brute_force import row_levels
    return len(row_levels(entry))


def random_rows(rng, scene):
    wanted, count, result = rng.randint(0, min(6, len(scene.coordinates) - 1)), 0, []
    free = list(scene.coordinates)
    for attempt in range(20):
        entry = one_row(rng, scene, free, "close" if attempt < 3 and not result and wanted > 2 else None)
        if count + row_count(entry) <= wanted:
            result.append(entry)
            count += row_count(entry)
    return result


def random_model(seed, few=True, elements=0):
    """few: at most about ten coordinates. elements: of beams and chains of equal links, which become loops."""
    rng = random.Random(seed)
    make = (lambda: run_links(rng, elements)) if elements else (lambda: random_links(rng, few))
    links, ways = make()
    least, most = (min(8, elements), 4 * elements) if elements else (3, 11 if few else 30)
    while not least <= len(coordinate_names(links)) <= most:
        links, ways = make()
    scene = Scene(rng, links)
    if elements:
        scene.name_few()
    model = {"name": f"random_{seed}", "gravity": vector(rng, 9.81), "links": links, "ways": ways}
    model["points"] = {"E": {"on": rng.choice(scene.names[-2:]), "at": vector(rng, 0.5)}, "F": scene.place(rng.choice(scene.names))}
    if rng.random() < 0.3:
        model["points"]["G"] = {"on": "ground", "at": vector(rng, 0.5)}
    model["inputs"] = {"u": 1.25}
    model["curves"] = {"course": [(0.0, 0.2), (0.7, -0.4), (1.1, 0.3), (2.5, 0.1), (2.75, 0.5)]}
    if rng.random() < 0.2 and not elements:
        model["form"] = "printed"
    model["forces"] = {"by_coordinate": coordinate_forces(rng, scene), "list": force_list(rng, scene, few)}
    model["rows"] = random_rows(rng, scene)
    return model


def coordinate_names(links):
    names = []
    for link in links:
        joints = link.get("joint", [])
        names += [f"{link['name']}_{kind}" for kind in (["x", "y", "z", "psi", "theta", "phi"] if joints == ["free"] else joints)]
        if "beam" in link:
            data = link["beam"]
            count = sum(part.get("rfe", data.get("rfe")) - 1 for part in data.get("segments", [data]))
            names += [f"{link['name']}_{kind}_{element}" for element in range(1, count + 1)
                      for kind in TURNS if kind in data.get("dofs", TURNS)]
    return names


def random_state(rng, n, size=0.6):
    return {"t": round(rng.uniform(0, 3), 6), "q": [round(rng.uniform(-size, size), 6) for _ in range(n)],
            "qd": [round(rng.uniform(-2, 2), 6) for _ in range(n)]}


def features(model):
    """Parts of the language that a model uses: fields, tags, ways of turning, levels of rows."""
    def words(data):
        if isinstance(data, Tagged):
            yield " ".join([data.tag] + list(data.get("joint", ())))
            data = {**data.fields, "items": data.items}
        if isinstance(data, dict):
            for name, entry in data.items():
                yield name
                yield from words(entry)
        elif isinstance(data, (list, tuple)):
            for entry in data:
                yield from words(entry)
        elif isinstance(data, Formula):
            yield from re.findall(r"course|inputs|axes|[a-z0-9]+(?=\()", data)
        elif isinstance(data, str):
            yield data
    names = {link["name"] for link in model["links"]} | set(coordinate_names(model["links"])) | {model["name"]}
    return {word for word in words(model) if word not in names and not word.endswith(".tip")}


def statics_model(seed):
    """A random model with an equilibrium: a spring at every joint, loads that act at rest, no rows. Half of the models hold one coordinate."""
    rng = random.Random(seed)
    model = random_model(seed)
    model.pop("form", None)
    model["rows"] = []
    for link in model["links"]:
        kinds = ["x", "y", "z", "psi", "theta", "phi"] if link.get("joint") == ["free"] else link.get("joint", [])
        link["spring"] = {kind: value(rng, 400, 900) for kind in kinds}
        for part in [link.get("beam", {})] + link.get("beam", {}).get("segments", []):
            part.update({"E": 2.1e11} if "E" in part else {})
    for entry in model["forces"]["list"]:
        entry.items = tuple(at_rest(item) for item in entry.items)
    model["forces"]["by_coordinate"] = {name: at_rest(text) for name, text in model["forces"]["by_coordinate"].items()}
    if seed % 2:
        model["hold"] = (rng.choice(coordinate_names(model["links"])),)
    return model


def at_rest(data):
    """The same load with cosines of time instead of sines."""
    if isinstance(data, Formula):
        return Formula(data.replace("rd.sin(", "rd.cos("))
    return tuple(map(at_rest, data)) if isinstance(data, tuple) else data


# ---- as Lua ----

class Writer:
    """Writes data as Lua. Parameters are named in order of occurrence; equal parameters share a name."""

    def __init__(self):
        self.parameters = []

    def text(self, data):
        if isinstance(data, Formula):
            return str(data)
        if isinstance(data, str):
            return f'"{data}"'
        if isinstance(data, Parameter):
            known = [i for i, other in enumerate(self.parameters) if other is data]
            if not known:
                self.parameters.append(data)
            return f"p.p{known[0] + 1 if known else len(self.parameters)}"
        if isinstance(data, dict):
            return "{ " + ", ".join(f"{name} = {self.text(entry)}" for name, entry in data.items()) + " }"
        if isinstance(data, (list, tuple)):
            return "{ " + ", ".join(map(self.text, data)) + " }"
        if isinstance(data, Tagged):
            items = [self.text(item) for item in data.items]
            if data.tag in ("round", "tube", "rectangle") and items:
                return f"rd.{data.tag}({', '.join(items)})"
            return f"rd.{data.tag} {{ " + ", ".join(items + [f"{name} = {self.text(entry)}" for name, entry in data.fields.items()]) + " }"
        return repr(float(data)) if isinstance(data, float) else repr(data)

    def lines(self, entries):
        return "".join(f"    {self.text(entry)},\n" for entry in entries)


def as_lua(model):
    """The model as a file of the model language."""
    writer = Writer()
    form = f'form = "{model["form"]}", ' if "form" in model else ""
    body = f'return rd.model {{\n  name = "{model["name"]}", {form}gravity = {writer.text(model["gravity"])},\n'
    body += "  links = {\n" + writer.lines(model["links"]) + "  },\n"
    body += f"  points = {writer.text(model['points'])},\n"
    body += f"  hold = {writer.text(model['hold'])},\n" if "hold" in model else ""
    given = model["forces"]
    body += "  forces = function(s) return {\n" + "".join(f"    {name} = {text},\n" for name, text in given["by_coordinate"].items())
    body += writer.lines(given["list"]) + "  } end,\n"
    body += "  constraints = function(s) return {\n" + writer.lines(model["rows"]) + "  } end,\n}\n"
    head = '-- A random model for the tests.\nlocal rd = require "refdyn"\n'
    listed = ", ".join(f'{{ "p{i + 1}", {float(number)!r} }}' for i, number in enumerate(writer.parameters))
    head += f"local p = rd.parameters {{ {listed} }}\n" if listed else ""
    head += "".join(f'rd.input("{name}", {float(number)!r})\n' for name, number in model["inputs"].items())
    head += "".join(f"local {name} = rd.spline {writer.text(samples)}\n" for name, samples in model["curves"].items())
    return head + "\n" + body
