-- expect: 16: limits.unknown: a motion has no column "b_x" of a coordinate, point, course or input
-- expect: 17: limits.E_xd: a column of the motion has this name; give its bounds by column, or choose another name
-- expect: 18: limits.energy: a column of the motion has this name; give its bounds by column, or choose another name
-- expect: 19: limits.phi_1: a column of the motion has this name; give its bounds by column, or choose another name
-- expect: 20: limits.force: a motion has no column "force_b_x" of a coordinate, point, course or input
-- expect: 21: limits.deep: depends on accelerations; a value that is recorded may depend on t, q, qd and inputs only
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 }, limits = { x = { from = -1 } } } },
  points = { E = "a" },
  courses = function(s) return { way = s.q.a_x } end,
  limits = function(s)
    return {
      { "unknown", column = "b_x", to = 1 },
      { "E_xd", s.t, to = 1 },
      { "energy", s.t, to = 1 },
      { "phi_1", s.t, to = 1 },
      { "force", column = "force_b_x", to = 1 },
      { "deep", s.points.E.xdd, to = 1 },
    }
  end,
}
