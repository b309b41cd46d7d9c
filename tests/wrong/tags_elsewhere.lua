-- expect: 11: links[1]: made by rd.box; must be a link such as { "arm", joint = "z" }
-- expect: 12: links[2].bodies[1]: has no field of a body (has It, Iy, Iz, area); write rd.box { ... } or { mass = 1 }
-- expect: 13: links[3].inertia: made by rd.sphere; must be an inertia such as { zz = 0.05 }
-- expect: 14: links[4].at: made by rd.position; must be a list of 3 numbers such as { 0, 0, 1 }
-- expect: 15: links[5].beam.section: made by rd.tube; must be a section such as rd.round(0.014)
-- expect: 17: points.E: made by rd.force; must be a point such as { on = "arm", at = { 0, 0, 1 } }
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
