-- expect: 8: more than 100 million steps to read the model; look for a loop without an end
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) while true do end end,
}
