-- expect: 5: text "first\nsecond": contains control character 10; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  constraints = function(s)
    return { rd.position { s.q.a_x - 1, name = "first\nsecond" } }
  end,
}
