-- expect: 9: s.start: has no accelerations; use q, qd, positions and velocities
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = { { "a", joint = "free", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } } },
  points = { E = "a" },
  constraints = function(s)
    return { rd.velocity {
      s.points.E.wx - rd.parameter("w", s.start.points.E.wxd) } }
  end,
}
