-- expect: 11: links[1]: made by rd.box, a link such as { "arm", joint = "z" } is needed
-- expect: 12: links[2].bodies[1]: no field of a body (It Iy Iz area), rd.box { ... } or { mass = 1 } is needed
-- expect: 13: links[3].inertia: made by rd.sphere, an inertia such as { zz = 0.05 } is needed
-- expect: 14: links[4].at: made by rd.position, a list of 3 numbers such as { 0, 0, 1 } is needed
-- expect: 15: links[5].beam.section: made by rd.tube, a section such as rd.round(0.014) is needed
-- expect: 17: points.E: made by rd.force, a point such as { on = "arm", at = { 0, 0, 1 } } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    rd.box { { 1, 1, 1 }, mass = 1 },
    { "b", joint = "z", bodies = { rd.round(0.1) } },
    { "c", joint = "z", mass = 1, inertia = rd.sphere { diameter = 1, mass = 1 } },
    { "d", joint = "z", mass = 1, at = rd.position { 0 } },
    { "e", joint = "z", beam = { length = 1, section = rd.tube { outer = 1, inner = 0.5 }, E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4 } },
  },
  points = { E = rd.force { "c" } },
}
