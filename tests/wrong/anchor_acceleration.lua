-- expect: 11: s.start: has no accelerations; use q, qd, positions and velocities
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.position { s.q.a_x - rd.parameter("x0", s.start.points.E.xdd, "m") },
    }
  end,
}
