-- expect: 11: links[1].rest: has no effect without spring; add spring
-- expect: 12: links[2].rest.x: has no effect without spring.x; add spring.x
-- expect: 13: links[3].center: has no effect without mass; add mass
-- expect: 14: links[4].inertia: has no effect without mass; add mass
-- expect: 15: links[5].along: has no effect without on; add on
-- expect: 16: links[6].beam.damping.mode: has no effect without ratio; add ratio
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = 1, rest = { z = 1 } },
    { "b", joint = "z, x", mass = 1, spring = { z = 1 }, rest = { x = 1 } },
    { "c", joint = "z", center = { 0, 0, 1 } },
    { "d", joint = "z", inertia = { zz = 1 } },
    { "e", joint = "z", mass = 1, along = 0.5 },
    { "f", joint = "z", beam = { length = 1, section = rd.round(0.014), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4, damping = { tip_mass = 1, mode = 2 } } },
  },
}
