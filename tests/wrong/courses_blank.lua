-- expect: 4: courses.' a_x': a blank at an end, which readers of a motion leave out, another name is needed
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s) return { [" a_x"] = 2 * s.q.a_x, ["three x"] = s.q.a_x } end }
