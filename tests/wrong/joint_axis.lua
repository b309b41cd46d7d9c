-- expect: 11: links[1].axis: the link has 2 coordinates; an axis needs exactly one
-- expect: 12: links[2].axis: length 0; must be a direction
-- expect: 13: links[3].axis: has no effect without joint; add joint
-- expect: 14: links[4].axis: 2 numbers; must have 3
-- expect: 15: links[5].axis: "w" is not an axis; use x, y or z
-- expect: 16: links[6].axis: length 1e-200; must be from 1e-100 to 1e+100
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
