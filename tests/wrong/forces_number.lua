-- expect: 8: forces: the function gives a number, a table such as { arm_psi = 1 }, {} for none, is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) return 3 end,
}
