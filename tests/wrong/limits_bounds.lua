-- expect: 15: limits[1]: has no bound; add from or to
-- expect: 16: limits[2]: from 1 to -1; the range must ascend
-- expect: 17: limits[3].to: a text; must be a number
-- expect: 18: limits[4].to: an expression; must be a number
-- expect: 19: limits[5].too: unknown field; did you mean "to"?
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 }, limits = { x = { from = -1 } } } },
  points = { E = "a" },
  courses = function(s) return { way = s.q.a_x } end,
  limits = function(s)
    return {
      { "none", s.t * p.v },
      { "crossed", s.t, from = 1, to = -1 },
      { "text", s.t, to = "2" },
      { "parameter", s.t, to = p.v },
      { "field", s.t, too = 1 },
    }
  end,
}
