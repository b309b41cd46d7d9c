-- expect: 17: s.q.arm_x: unknown coordinate; did you mean "arm_z"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  constraints = function(s)
    return {
      rd.drive { "arm_x", 1 },
      rd.lock { "arm_x" },
    }
  end,
  forces = function(s)
    return {
      rd.actuator { "hand", "ground", s.q.arm_x },
    }
  end,
  dependent = { "arm_x" },
}
