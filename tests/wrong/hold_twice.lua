-- expect: 8: hold[2]: "a_x" is given twice; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  hold = "a_x, a_x",
}
