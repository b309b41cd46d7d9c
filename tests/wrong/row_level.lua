-- expect: 7: constraints: number of rows is 4; must be at most that of coordinates, 1
-- expect: 15: constraints[1]: depends on velocities; use rd.velocity
-- expect: 16: constraints[2]: depends on accelerations; use rd.acceleration
-- expect: 17: constraints[3]: depends on positions, but on no velocity; must contain a rate or the velocity of a moving point, as s.points.tip.zd; rd.position keeps a position
-- expect: 18: constraints[4]: not linear in the accelerations; must be of the form a qdd + b
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.points.E.xd },
      rd.velocity { s.qdd.a_x },
      rd.velocity { s.q.a_x },
      rd.acceleration { s.qdd.a_x^2 },
    }
  end,
}
