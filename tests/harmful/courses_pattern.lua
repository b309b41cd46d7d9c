-- expect: 7: string.find: more work than the 100 million steps that a model may take while it is read
-- Tries an endless pattern in courses.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s)
    local found = (("a"):rep(30)):find(("a?"):rep(30) .. ("a"):rep(30) .. "b")
    return {}
  end }
