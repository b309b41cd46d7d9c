-- expect: 8: forces: the function returns a number; must return a table such as { arm_psi = 1 }, or {} for none
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) return 3 end,
}
