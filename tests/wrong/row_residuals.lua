-- expect: 15: constraints[1][2]: an expression without a name; write rd.position { expression } for each row
-- expect: 16: constraints[2][2]: an expression without a name; write rd.velocity { expression } for each row
-- expect: 17: constraints[3][3]: a number without a name; write rd.lock { "arm_psi" }
-- expect: 18: constraints[4][4]: a number without a name; write rd.distance { "a", "b", expression }
-- expect: 19: constraints[5].residual: given by name and as item 1; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  constraints = function(s)
    return {
      rd.position { s.q.arm_z, s.q.hand_psi },
      rd.velocity { s.qd.arm_z, s.qd.hand_psi, alpha = 1 },
      rd.lock { "arm_z", 1, 2 },
      rd.distance { "arm", "ground", 1, 2 },
      rd.position { s.q.arm_z, residual = s.q.hand_psi },
    }
  end,
}
