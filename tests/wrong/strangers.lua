-- expect: 8: links[1].beam: no field of a beam (elements mass stiffness), { length = 1, section = rd.round(0.014), ... } is needed
-- expect: 9: links[2].bodies[1]: no field of a box (height weight width), rd.box { { 1, 1, 1 }, mass = 1 } is needed
-- expect: 10: links[3].inertia: no field of an inertia (moment radius), { zz = 0.05 } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", beam = { stiffness = 1, mass = 2, elements = 3 } },
    { "b", joint = "z", bodies = { rd.box { width = 1, height = 1, weight = 1 } } },
    { "c", on = "arm.tip", joint = "z", mass = 1, inertia = { 1, 1, 1, moment = 2, radius = 1 } },
  },
}
