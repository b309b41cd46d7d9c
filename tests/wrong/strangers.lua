-- expect: 8: links[1].beam: has no field of a beam (has elements, mass, stiffness); write { length = 1, section = rd.round(0.014), ... }
-- expect: 9: links[2].bodies[1]: has no field of a box (has height, weight, width); write rd.box { { 1, 1, 1 }, mass = 1 }
-- expect: 10: links[3].inertia: has no field of an inertia (has moment, radius); write { zz = 0.05 }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", beam = { stiffness = 1, mass = 2, elements = 3 } },
    { "b", joint = "z", bodies = { rd.box { width = 1, height = 1, weight = 1 } } },
    { "c", on = "arm.tip", joint = "z", mass = 1, inertia = { 1, 1, 1, moment = 2, radius = 1 } },
  },
}
