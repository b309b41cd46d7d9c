"""Random scenes for tests of derivatives: damped chains and trees, perhaps with a flexible link and a programme; scenes with kinks, jumps and events."""
import math
import random


def damped_scene(seed):
    """The text of a model, the names of its parameters, and their values."""
    rng = random.Random(seed)
    parameters, links, programme = {}, [], []

    def value(name, low, high):
        parameters[name] = round(rng.uniform(low, high), 4)
        return f"p.{name}"

    def three(low, high):
        return "{ " + ", ".join(f"{rng.uniform(low, high):.4f}" for _ in range(3)) + " }"

    count = rng.randint(2, 4)
    for i in range(count):
        joint = rng.choice(["psi", "theta", "phi", "x", "z"])
        place = f', on = "l{rng.randrange(i)}", at = {three(0.1, 0.4)}' if i else ""
        stiff = 400 if joint in "xz" else 20
        links.append(f'{{ "l{i}"{place}, turn = {{ {{ "{rng.choice("xyz")}", {rng.uniform(-1, 1):.4f} }} }}, joint = "{joint}", mass = {value(f"m{i}", 0.5, 2)}, '
                     f'center = {three(-0.2, 0.3)}, inertia = {{ xx = {rng.uniform(0.03, 0.05):.4f}, yy = {rng.uniform(0.03, 0.05):.4f}, zz = {rng.uniform(0.03, 0.05):.4f} }}, start = {{ {joint} = {rng.uniform(-0.3, 0.3):.4f} }}, '
                     f'spring = {{ {joint} = {value(f"k{i}", 0.5 * stiff, stiff)} }}, damper = {{ {joint} = {value(f"d{i}", 0.02 * stiff, 0.1 * stiff)} }} }}')
        driven = f"l{i}_{joint}"
    if seed % 2:
        links.append(f'{{ "beam", on = "l{count - 1}", at = {three(0, 0.2)}, beam = {{ length = 0.8, section = rd.tube(0.03, 0.024), E = {value("E", 2e9, 4e9)}, nu = 0.33, '
                     f'rho = 1500, eta = {value("eta", 1e-3, 4e-3)}, rfe = 2, dofs = "psi,theta" }} }}')
    if seed % 3 == 0:
        programme.append(f'rd.drive {{ "{driven}", rd.parameter("start", s.start.q.{driven}, "1") + {value("A", 0.1, 0.3)} * rd.smoothstep(s.t, 0.05, {value("T", 0.3, 0.5)}, 5), alpha = 0, beta = 0 }}')
    entries = ", ".join(f'{{ "{name}", {number} }}' for name, number in parameters.items())
    text = f"""local rd = require "refdyn"
local p = rd.parameters {{ {entries} }}
return rd.model {{
  name = "damped", gravity = {{ 0, 1.3, -9.81 }},
  links = {{ {", ".join(links)} }},
  constraints = function(s) return {{ {", ".join(programme)} }} end,
}}
"""
    return text, parameters


def eventful_scene(seed):
    """As damped_scene, for a scene with friction that saturates, forces that begin at a place or a time, impacts, contacts, perhaps a row."""
    rng = random.Random(seed)
    parameters, links, forces, events, rows = {}, [], [], [], []

    def value(name, low, high):
        parameters[name] = round(rng.uniform(low, high), 4)
        return f"p.{name}"

    def three(low, high):
        return "{ " + ", ".join(f"{rng.uniform(low, high):.4f}" for _ in range(3)) + " }"

    count, joints = rng.randint(2, 4), []
    for i in range(count):
        joint = rng.choice(["psi", "theta", "phi", "x", "z"])
        joints.append(f"l{i}_{joint}")
        place = f', on = "l{rng.randrange(i)}", at = {three(-0.2, 0.4)}' if i else ""
        stiff, force = (300, 5) if joint in "xz" else (15, 0.5)
        links.append(f'{{ "l{i}"{place}, turn = {{ {{ "{rng.choice("xyz")}", {rng.uniform(-1, 1):.4f} }} }}, joint = "{joint}", mass = {value(f"m{i}", 0.5, 2)}, '
                     f'center = {three(-0.2, 0.3)}, inertia = {{ xx = {rng.uniform(0.03, 0.05):.4f}, yy = {rng.uniform(0.03, 0.05):.4f}, zz = {rng.uniform(0.03, 0.05):.4f} }}, '
                     f'start = {{ {joint} = {rng.uniform(-0.3, 0.3):.4f} }}, start_rate = {{ {joint} = {rng.uniform(-1, 1):.4f} }}, '
                     f'spring = {{ {joint} = {value(f"k{i}", 0.4 * stiff, stiff)} }}, damper = {{ {joint} = {rng.uniform(0.005, 0.03) * stiff:.4f} }} }}')
        q, rate = f"s.q.{joints[i]}", f"s.qd.{joints[i]}"
        law = rng.choice([lambda: f"-{value(f'mu{i}', 0.5 * force, force)} * rd.max(-1, rd.min(1, {rate} / {value(f'w{i}', 0.05, 0.2)}))",
                          lambda: f"-{value(f'F{i}', 0.5 * force, force)} * rd.where(rd.less({q}, {value(f'c{i}', -0.05, 0.1)}), 0.2, 1)",
                          lambda: f"{value(f'F{i}', 0.5 * force, force)} * rd.where(rd.less(s.t, {value(f'T{i}', 0.2, 0.5)}), 1, -0.3)",
                          lambda: f"-{value(f'd{i}', 0.05 * force, 0.2 * force)} * {rate} * rd.abs({rate})"])
        forces.append(f"{joints[i]} = {law()}")
        if rng.random() < 0.25:
            rows.append(f'rd.contact {{ {q} + 0.3 + {value(f"s{i}", 0.05, 0.3)}, restitution = {value(f"e{i}", 0.2, 0.8)}, name = "contact{i}" }}')
        elif rng.random() < 0.4:
            events.append(f'rd.event {{ 0.3 + {value(f"s{i}", 0.05, 0.3)} - {q}, restitution = {value(f"e{i}", 0.6, 0.9)}, name = "stop{i}" }}')
    if count > 2 and rng.random() < 0.6:
        rows.append(f'rd.position {{ s.q.{joints[-1]} - {value("A", 0.1, 0.3)} * rd.sin({value("om", 2, 5)} * s.t) - 0.5 * s.q.{joints[0]} * {value("gear", 0.2, 0.6)} }}')
    entries = ", ".join(f'{{ "{name}", {number} }}' for name, number in parameters.items())
    text = f"""local rd = require "refdyn"
local p = rd.parameters {{ {entries} }}
return rd.model {{
  name = "eventful", gravity = {{ 0.3, 1.1, -9.81 }},
  links = {{ {", ".join(links)} }},
  constraints = function(s) return {{ {", ".join(rows)} }} end,
  forces = function(s) return {{ {", ".join(forces)} }} end,
  events = function(s) return {{ {", ".join(events)} }} end,
}}
"""
    return text, parameters


class RestingScene:
    """A scene whose bodies rest on floors, plates, hoists and each other while their loads jump. `is_steady`: impacts keep it predictable.
    by_caller: loads that jump at a time are inputs instead, and `schedule` has their jumps: time, input, value before and after."""

    def __init__(self, seed, by_caller=False):
        rng = self.rng = random.Random(seed)
        self.by_caller, self.schedule = by_caller, []
        self.parameters, self.inputs, self.links, self.rows, self.contacts, self.forces, self.events = [], [], [], [], [], {}, []
        self.is_steady = True
        self.frame, self.weight = "", 9.81
        self.link("k", joint="x", mass=1, start_rate="{ x = 1 }")
        self.forces["k_x"] = self.number(0.1, 0.3)
        ground = rng.choice(["level", "tilts", "turned"])
        if ground == "tilts":
            size, pace = rng.uniform(0.1, 0.5), rng.uniform(1, 4)
            self.link("bed", joint="theta", mass=20, inertia="{ yy = 2 }", start_rate=f"{{ theta = {size * pace!r} }}")
            self.rows.append(f'rd.drive {{ "bed_theta", {size!r} * rd.sin({pace!r} * s.t) }}')
            self.frame, self.weight = ', on = "bed"', 0.9 * self.weight
        elif ground == "turned":
            turns = [rng.uniform(-1, 1) for _ in "xy"]
            self.frame = f', turn = {{ {{ "x", {turns[0]:.4f} }}, {{ "y", {turns[1]:.4f} }} }}'
            self.weight *= math.cos(turns[0]) * math.cos(turns[1])
        for i in range(rng.randint(1, 3)):
            self.place = f"{{ {self.number(-1, 1)}, {self.number(-1, 1)}, 0 }}"
            self.restitution = rng.choice([0, 0, rng.uniform(0.1, 0.5)])
            add = rng.choice([self.add_box, self.add_box, self.add_light_box, self.add_kicked_box, self.add_plate, self.add_hoist, self.add_stack,
                              self.add_rod, self.add_table])
            add(f"b{i}", rng.uniform(0.5, 3))

    def number(self, low, high):
        return f"{self.rng.uniform(low, high):.5f}"

    def time(self):
        return self.rng.uniform(0.15, 1.1)

    def link(self, name, frame="", **fields):
        self.links.append(f'{{ "{name}"{frame}, ' + ", ".join(f'{key} = "{value}"' if key == "joint" else f"{key} = {value}" for key, value in fields.items()) + " }")

    def body(self, name, mass, joint="z", **fields):
        self.link(name, self.frame, at=self.place, joint=joint, mass=mass, **fields)

    def contact(self, gap):
        self.contacts.append(f'rd.contact {{ {gap}, restitution = {self.restitution:.3f}, name = "c{len(self.contacts)}" }}')

    def parameter(self, value):
        self.parameters.append(f'{{ "p{len(self.parameters)}", {value} }}')
        return f"p{len(self.parameters) - 1}"

    def input(self, value):
        name = f"u{len(self.inputs)}"
        self.inputs.append(f'local {name} = rd.input("{name}", {value})')
        return name

    def event(self, action):
        self.events.append(f'rd.event {{ s.q.k_x - {self.number(0.15, 1)}, {action}, name = "switch{len(self.events)}" }}')

    def load(self, weight):
        """A force or moment that at times exceeds what holds the body down."""
        low, high = f"{self.rng.uniform(-0.3, 0.8) * weight:.4f}", f"{self.rng.uniform(0.9, 1.6) * weight:.4f}"
        first, second = (low, high) if self.rng.random() < 0.8 else (high, low)
        kind = self.rng.choice(["time", "pulse", "place", "rate", "both", "input", "parameter", "wave"])
        begin = self.time()
        if kind == "pulse":
            return f"rd.where(rd.less(s.t, {begin}), {low}, rd.where(rd.less(s.t, {begin + self.rng.choice([0.2, 0.01])}), {high}, {low}))"
        if kind == "input":
            name = self.input(first)
            self.event(f"inputs = {{ {name} = {second} }}")
            return name
        if kind == "parameter":
            name = self.parameter(first)
            self.event(f"parameters = {{ {name} = {second} }}")
            return f"p.{name}"
        if kind == "wave":
            return f"{weight * self.rng.uniform(0.9, 1.5):.4f} * rd.sin({self.number(2, 6)} * s.t + {self.number(0, 3)})"
        less = {"time": f"s.t, {begin!r}", "place": f"s.q.k_x, {self.number(0.15, 1)}", "rate": f"s.qd.k_x, {self.number(1.02, 1.1)}",
                "both": f"s.q.k_x + 0.2 * s.t, {self.number(0.2, 1.2)}"}[kind]
        if kind == "time" and self.by_caller:
            self.schedule.append((begin, self.input(first), float(first), float(second)))
            return self.schedule[-1][1]
        return f"rd.where(rd.less({less}), {first}, {second})"

    def add_box(self, name, mass):
        self.body(name, f"{mass:.4f}")
        self.contact(f"s.q.{name}_z")
        self.forces[f"{name}_z"] = self.load(mass * self.weight)

    def add_light_box(self, name, mass):
        """An event takes so much of the mass away that the load lifts the rest."""
        size = self.parameter(f"{mass:.4f}")
        self.body(name, f"p.{size}")
        self.contact(f"s.q.{name}_z")
        self.forces[f"{name}_z"] = f"{0.8 * mass * self.weight:.4f}"
        self.event(f"parameters = {{ {size} = {self.rng.uniform(0.5, 0.9) * mass:.4f} }}")

    def add_kicked_box(self, name, mass):
        self.body(name, f"{mass:.4f}")
        self.contact(f"s.q.{name}_z")
        self.event(f"rates = {{ {name}_z = {self.number(-0.5, 2)} }}")

    def add_plate(self, name, mass):
        """A plate that is raised with a bounded acceleration, and brakes faster than the box falls."""
        begin, plate = self.time(), f"plate{name}"
        self.body(plate, 2)
        self.body(name, f"{mass:.4f}")
        end = begin + self.rng.uniform(0.2, 0.4)
        self.rows.append(f'rd.drive {{ "{plate}_z", {self.number(0.3, 0.8)} * rd.smoothstep(s.t, {begin:.4f}, {end:.4f}, 3) }}')
        self.contact(f"s.q.{name}_z - s.q.{plate}_z")

    def add_hoist(self, name, mass):
        """A load on a rope whose winch brakes."""
        speed, begin = self.rng.uniform(0.5, 1.5), self.time()
        self.link(f"winch{name}", joint="psi", mass=1, inertia="{ zz = 0.05 }", start_rate=f"{{ psi = {5 * speed!r} }}")
        self.body(name, f"{mass:.4f}", start_rate=f"{{ z = {speed!r} }}")
        slows = f"rd.max(0, rd.min(1, (s.t - {begin:.4f}) / {self.number(0.02, 0.2)}))"
        self.rows.append(f"rd.velocity {{ s.qd.winch{name}_psi - {5 * speed!r} * (1 - {slows}) }}")
        self.contact(f"s.q.{name}_z - 0.2 * s.q.winch{name}_psi")

    def add_stack(self, name, mass):
        self.body(name, f"{mass:.4f}")
        self.body(f"{name}up", f"{mass / 2:.4f}")
        self.contact(f"s.q.{name}_z")
        self.contact(f"s.q.{name}up_z - s.q.{name}_z")
        self.forces[self.rng.choice([f"{name}up_z", f"{name}_z"])] = self.load(self.rng.choice([0.5, 1, 1.5]) * mass * self.weight)

    def add_rod(self, name, mass):
        self.body(name, f"{mass:.4f}", "z, theta", center=f"{{ {self.number(-0.1, 0.1)}, 0, 0 }}", inertia=f"{{ yy = {self.number(0.05, 0.3)} }}")
        for x in (-0.5, self.rng.uniform(0.3, 0.5)):
            self.contact(f"s.q.{name}_z - {x:.3f} * rd.sin(s.q.{name}_theta)")
        self.forces[f"{name}_z"] = self.load(0.6 * mass * self.weight)
        self.forces[f"{name}_theta"] = self.load(0.3 * mass * self.weight)
        self.is_steady = False

    def add_table(self, name, mass):
        """Four legs, whose forces are not unique."""
        self.body(name, f"{mass:.4f}", "z, theta, phi", center=f"{{ {self.number(-0.1, 0.1)}, {self.number(-0.1, 0.1)}, 0 }}",
                  inertia=f"{{ xx = {self.number(0.15, 0.25)}, yy = {self.number(0.15, 0.25)}, zz = 0.2 }}")
        for x in (-0.4, 0.4):
            for y in (-0.4, 0.4):
                self.contact(f"s.q.{name}_z - {x} * rd.sin(s.q.{name}_theta) + {y} * rd.sin(s.q.{name}_phi)")
        self.forces[f"{name}_{self.rng.choice(['z', 'theta', 'phi'])}"] = self.load(0.4 * mass * self.weight)
        self.is_steady = False

    def text(self):
        inputs = "\n".join(self.inputs)
        return f"""local rd = require "refdyn"
local p = rd.parameters {{ {", ".join(self.parameters)} }}
{inputs}
return rd.model {{
  name = "resting", gravity = {{ 0, 0, -9.81 }},
  links = {{ {", ".join(self.links)} }},
  constraints = function(s) return {{ {", ".join(self.rows + self.contacts)} }} end,
  forces = function(s) return {{ {", ".join(f"{name} = {law}" for name, law in self.forces.items())} }} end,
  events = function(s) return {{ {", ".join(self.events)} }} end,
}}
"""
