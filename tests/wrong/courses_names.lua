-- expect: 4: name in courses: contains control character 10, a line of text is needed
-- expect: 4: courses.one,two: a comma, which parts the columns of a motion, another name is needed
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } }, courses = function(s) return { ["one\ntwo"] = s.t, ["one,two"] = s.t } end }
