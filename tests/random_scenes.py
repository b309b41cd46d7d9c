"""Random damped scenes for tests of derivatives: chains and trees with springs, dampers, perhaps a flexible link and a programme."""
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
