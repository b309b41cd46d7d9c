-- expect: 7: constraints: 4 rows, at most as many as coordinates, 1, can hold
-- expect: 15: constraints[1]: depends on velocities, rd.velocity is for such rows
-- expect: 16: constraints[2]: depends on accelerations, rd.acceleration is for such rows
-- expect: 17: constraints[3]: depends on no coordinate, a rate or the velocity of a point that moves is needed
-- expect: 18: constraints[4]: not linear in the accelerations, a qdd + b is needed
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
