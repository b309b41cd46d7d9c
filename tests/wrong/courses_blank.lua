-- expect: 4: courses.' a_x': the name begins or ends with a blank, which programs drop; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s) return { [" a_x"] = 2 * s.q.a_x, ["three x"] = s.q.a_x } end }
