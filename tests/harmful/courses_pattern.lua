-- expect: 7: string.find: more than the 100 million steps that reading a model may take
-- Tries an endless pattern in courses.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s)
    local found = (("a"):rep(30)):find(("a?"):rep(30) .. ("a"):rep(30) .. "b")
    return {}
  end }
