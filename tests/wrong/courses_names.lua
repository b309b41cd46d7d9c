-- expect: 4: courses.one,two: the name contains a comma, which separates columns; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s) return { ["one,two"] = 2 * s.q.a_x, three = s.q.a_x } end }
