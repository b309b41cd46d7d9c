-- expect: 11: rd.position: 2 arguments; must have 1, as in rd.position { expression }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  constraints = function(s)
    return {
      rd.position({ s.q.arm_z }, 5),
    }
  end,
}
