-- expect: 11: links[1].axis: the link has 2 coordinates, one is needed
-- expect: 12: links[2].axis: of length 0, a direction is needed
-- expect: 13: links[3].axis: given without joint, joint is needed
-- expect: 14: links[4].axis: 2 numbers, 3 are needed
-- expect: 15: links[5].axis: "w" is no axis, x y z are
-- expect: 16: links[6].axis: of length 1e-200, from 1e-100 to 1e+100 is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = {
    { "two", joint = "x, psi", axis = { 0, 0.6, 0.8 }, mass = 1, inertia = { zz = 1 } },
    { "none", joint = "psi", axis = { 0, 0, 0 }, mass = 1, inertia = { zz = 1 } },
    { "weld", axis = { 0, 0, 1 }, mass = 1 },
    { "plane", joint = "psi", axis = { 0, 1 }, mass = 1, inertia = { zz = 1 } },
    { "letter", joint = "psi", axis = "w", mass = 1, inertia = { zz = 1 } },
    { "tiny", joint = "x", axis = { 1e-200, 0, 0 }, mass = 1 },
  },
}
