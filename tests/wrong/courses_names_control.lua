-- expect: 4: name "one\ntwo": contains control character 10; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s) return { ["one\ntwo"] = s.q.a_x } end }
