-- expect: 17: links[1].inertia: a number; must be an inertia such as { zz = 0.05 }
-- expect: 18: links[2].inertia[1]: a number without a name; write { zz = 0.05 }
-- expect: 19: links[3].beam.section: a number; must be a section such as rd.round(0.014)
-- expect: 20: links[4].beam.section: has no field of a section; write rd.round(0.014)
-- expect: 21: links[5].beam: a number; must be a beam such as { length = 1, section = rd.round(0.014), ... }
-- expect: 22: links[6].start: has entries without a name; must be a table by joint such as { z = 1 }
-- expect: 23: links[7].spring: a number; must be a table by joint such as { z = 1 }
-- expect: 24: links[8].beam.damping: a number; must be a damping such as { ratio = 0.01 }
-- expect: 24: links[8].beam.curvature: a number; must be a curvature such as { psi = 0.1 }
-- expect: 25: links[9].bodies: made by rd.sphere; must be a list of tables
-- expect: 27: points: a text; must be a table of points such as { E = "arm" }
-- expect: 28: hold: a truth value; must be a list of names such as { "a", "b" }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = 1, inertia = 0.05 },
    { "b", joint = "z", mass = 1, inertia = { 0.05, 0.05, 0.05 } },
    { "c", joint = "z", beam = { length = 1, section = 0.014, E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4 } },
    { "d", joint = "z", beam = { length = 1, section = { 0.014 }, E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4 } },
    { "e", joint = "z", beam = 2 },
    { "f", joint = "z", mass = 1, start = { 0.5 } },
    { "g", joint = "z", mass = 1, spring = 100 },
    { "h", joint = "z", beam = { length = 1, section = rd.round(0.014), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4, damping = 0.01, curvature = 0.1 } },
    { "i", joint = "z", bodies = rd.sphere { diameter = 1, mass = 1 } },
  },
  points = "a",
  hold = true,
}
