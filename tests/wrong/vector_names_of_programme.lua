-- expect: 14: forces[1].value: has named entries (z); must be a list of 3 numbers or expressions such as { 0, 0, 1 }
-- expect: 15: forces[2].value: has named entries (x); must be a list of 3 numbers or expressions such as { 0, 0, 1 }
-- expect: 20: constraints[1].a.direction: has named entries (x); must be a list of 3 numbers such as { 0, 0, 1 }
-- expect: 20: constraints[1].b.direction: has named entries (z); must be a list of 3 numbers such as { 0, 0, 1 }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s)
    return {
      rd.force { "arm", { z = 1 } },
      rd.torque { "hand", { 0, 0, 1, x = 1 } },
    }
  end,
  constraints = function(s)
    return {
      rd.parallel { { "arm", { 0, 0, 1, x = 1 } }, { "hand", { z = 1 } } },
    }
  end,
}
