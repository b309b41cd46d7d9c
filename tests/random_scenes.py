"""Random scenes for tests of derivatives: damped chains and trees, perhaps with a flexible link and a programme; scenes with kinks, jumps and events."""
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
