-- expect: 11: constraints[1]: depends on no coordinate; must contain a coordinate or the position of a moving point
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.loop { "ground", { on = "ground", at = { 1, 0, 0 } }, keep = "x" },
    }
  end,
}
