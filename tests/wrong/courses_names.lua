-- expect: 4: courses.one,two: a comma, which parts the columns of a motion, another name is needed
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s) return { ["one,two"] = 2 * s.q.a_x, three = s.q.a_x } end }
