-- expect: 9: constraints[1]: depends on positions, but on no velocity; must contain a rate or the velocity of a moving point, as s.points.tip.zd; rd.position keeps a position
-- expect: 10: constraints[2]: depends on velocities, but on no acceleration; must contain an acceleration, as s.qdd.arm_psi or s.points.tip.zdd; rd.velocity keeps a velocity
-- expect: 11: constraints[3]: depends on positions, but on no acceleration; must contain an acceleration, as s.qdd.arm_psi or s.points.tip.zdd; rd.position keeps a position
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 }, links = { { "a", joint = "x, y, z", mass = 1 } }, points = { tip = "a" },
  constraints = function(s)
    return {
      rd.velocity { s.points.tip.z },
      rd.acceleration { s.points.tip.zd + s.q.a_x },
      rd.acceleration { s.points.tip.z },
    }
  end,
}
