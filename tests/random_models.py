"""Random trees as data, and the same trees as Lua. Equal seeds give equal models."""
import random

import mpmath

KINDS = ["x", "y", "z", "phi", "theta", "psi"]


def vector(rng, size):
    return tuple(round(rng.uniform(-size, size), 6) for _ in range(3))


def solid(rng):
    """Mass, centre and tensor of four random point masses: a body that can exist, with products of inertia."""
    parts = [(rng.uniform(0.2, 2), vector(rng, 0.4)) for _ in range(4)]
    mass = sum(m for m, _ in parts)
    center = [sum(m * r[i] for m, r in parts) / mass for i in range(3)]
    tensor = [0.0] * 6
    for m, r in parts:
        x, y, z = (r[i] - center[i] for i in range(3))
        for entry, value in enumerate((y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)):
            tensor[entry] += m * value
    return {"mass": mass, "center": tuple(center), "inertia": tuple(tensor)}


def joint(rng, link, few):
    link["joint"] = rng.sample(KINDS, rng.randint(0 if few else 1, 2 if few else 3))
    for kind in link["joint"]:
        if rng.random() < 0.5:
            link.setdefault("spring", {})[kind] = round(rng.uniform(1, 50), 6)
        if rng.random() < 0.5:
            link.setdefault("damper", {})[kind] = round(rng.uniform(0.1, 5), 6)


def random_model(seed):
    rng = random.Random(seed)
    links = []
    for number in range(rng.randint(2, 4)):
        link = {"name": f"part{number}", "at": vector(rng, 0.8), **solid(rng),
                "turn": [(rng.choice("xyz"), round(rng.uniform(-2, 2), 6)) for _ in range(rng.randint(0, 2))]}
        if number and rng.random() < 0.85:
            link["on"] = rng.choice(links)["name"]
        joint(rng, link, number > 0)
        links.append(link)
    if seed % 2:
        beam = {"length": round(rng.uniform(0.8, 2), 6), "diameter": round(rng.uniform(0.01, 0.03), 6), "E": 2.1e9,
                "nu": 0.31, "rho": 2710.5, "eta": 1.7e-3, "rfe": rng.randint(1, 3)}
        if rng.random() < 0.5:
            beam["dofs"] = tuple(rng.sample(("psi", "theta", "phi"), rng.randint(1, 2)))
            beam["dofs"] = tuple(kind for kind in ("psi", "theta", "phi") if kind in beam["dofs"])
        links.append({"name": "rod", "on": links[-1]["name"], "at": vector(rng, 0.3), "joint": ["theta"], "beam": beam})
        links.append({"name": "load", "on": "rod.tip", "turn": [("y", 0.4)], "joint": ["x"], **solid(rng)})
    model = {"name": f"random_{seed}", "gravity": vector(rng, 9.81), "links": links,
             "points": {"E": {"on": links[-1]["name"], "at": vector(rng, 0.5)}}}
    names = coordinate_names(links)
    a, b = rng.choice(names), rng.choice(names)
    model["forces"] = [(a, lambda t, q, qd: mpmath.sin(2 * t) * q[b] - 0.25 * qd[a] * abs(q[b]) ** 2,
                        f"rd.sin(2*s.t)*s.q.{b} - 0.25*s.qd.{a}*s.q.{b}^2")]
    model["rows"] = [
        {"level": "position", "alpha": 3.5, "beta": 2.25,
         "residual": lambda s: (s.x - 0.3) ** 2 / 4 + s.y * s.z - 0.7 * mpmath.sin(1.5 * s.t) + mpmath.cos(s.q[a]) / 5,
         "lua": f"(E.x - 0.3)^2/4 + E.y*E.z - 0.7*rd.sin(1.5*s.t) + rd.cos(s.q.{a})/5"},
        {"level": "velocity", "alpha": 1.75,
         "residual": lambda s: s.xd * s.y - 0.4 * s.z * s.t + 0.3 * s.qd[b] ** 2 + s.zd,
         "lua": f"E.xd*E.y - 0.4*E.z*s.t + 0.3*s.qd.{b}^2 + E.zd"},
        {"level": "acceleration",
         "residual": lambda s: s.ydd * (1 + s.x ** 2) + s.qdd[a] * s.t - s.xd * s.zd,
         "lua": f"E.ydd*(1 + E.x^2) + s.qdd.{a}*s.t - E.xd*E.zd"},
    ][:min(3, len(names) - 1)]
    return model


def coordinate_names(links):
    names = []
    for link in links:
        names += [f"{link['name']}_{kind}" for kind in link["joint"]]
        if "beam" in link:
            names += [f"{link['name']}_{kind}_{element}" for element in range(1, link["beam"]["rfe"])
                      for kind in link["beam"].get("dofs", ("psi", "theta", "phi"))]
    return names


def random_state(rng, n, size=0.6):
    return {"t": round(rng.uniform(0, 3), 6), "q": [round(rng.uniform(-size, size), 6) for _ in range(n)],
            "qd": [round(rng.uniform(-2, 2), 6) for _ in range(n)]}


def listed(values):
    return "{ " + ", ".join(repr(value) if not isinstance(value, str) else f'"{value}"' for value in values) + " }"


def named(values):
    return "{ " + ", ".join(f"{name} = {value!r}" for name, value in values.items()) + " }"


def link_text(link):
    parts = [f'"{link["name"]}"']
    if "on" in link:
        parts.append(f'on = "{link["on"]}"')
    if "at" in link:
        parts.append("at = " + listed(link["at"]))
    if link.get("turn"):
        parts.append("turn = { " + ", ".join(listed(turn) for turn in link["turn"]) + " }")
    if link["joint"]:
        parts.append("joint = " + listed(link["joint"]))
    if "mass" in link:
        parts.append(f"mass = {link['mass']!r}, center = {listed(link['center'])}")
        parts.append("inertia = " + named(dict(zip(("xx", "yy", "zz", "xy", "xz", "yz"), link["inertia"]))))
    parts += [f"{field} = {named(link[field])}" for field in ("spring", "damper") if field in link]
    if "beam" in link:
        beam = link["beam"]
        fields = {key: beam[key] for key in ("length", "E", "nu", "rho", "eta", "rfe")}
        dofs = f", dofs = {listed(beam['dofs'])}" if "dofs" in beam else ""
        parts.append("beam = " + named(fields)[:-2] + f", section = rd.round({beam['diameter']!r}){dofs} }}")
    return "    { " + ", ".join(parts) + " },\n"


def as_lua(model):
    """The model as a file of the model language."""
    points = ", ".join(f'{name} = {{ on = "{point["on"]}", at = {listed(point["at"])} }}'
                       for name, point in model["points"].items())
    gains = lambda row: "".join(f", {gain} = {row[gain]!r}" for gain in ("alpha", "beta") if gain in row)
    text = f'-- A random tree for the tests.\nlocal rd = require "refdyn"\n\nreturn rd.model {{\n  name = "{model["name"]}",\n'
    text += f'  gravity = {listed(model["gravity"])},\n  links = {{\n' + "".join(map(link_text, model["links"])) + "  },\n"
    text += f"  points = {{ {points} }},\n"
    text += "  forces = function(s)\n    return { " + ", ".join(f"{name} = {lua}" for name, _, lua in model["forces"]) + " }\n  end,\n"
    if model["rows"]:
        text += "  constraints = function(s)\n    local E = s.points.E\n    return {\n"
        text += "".join(f"      rd.{row['level']} {{ {row['lua']}{gains(row)} }},\n" for row in model["rows"])
        text += "    }\n  end,\n"
    return text + "}\n"
