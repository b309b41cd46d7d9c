-- expect: 11: rd.velocity: argument 1 is made by rd.position; must be a new table { ... }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  constraints = function(s)
    return {
      rd.velocity(rd.position { s.q.arm_z }),
    }
  end,
}
