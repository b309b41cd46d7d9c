-- expect: 13: limits[1]: the name "way" is already taken by a course or a limit; choose another name
-- expect: 15: limits[3]: the name "twice" is already taken by a course or a limit; choose another name
-- expect: 16: limits[4]: the name "a_x" is already taken by a course or a limit; choose another name
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 }, limits = { x = { from = -1 } } } },
  points = { E = "a" },
  courses = function(s) return { way = s.q.a_x } end,
  limits = function(s)
    return {
      { "way", s.t, to = 1 },
      { "twice", s.t, to = 1 },
      { "twice", s.t, to = 1 },
      { "a_x", column = "a_x_d", to = 1 },
    }
  end,
}
