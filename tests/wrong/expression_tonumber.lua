-- expect: 6: tonumber of an expression: its value is not known while the model is read
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = tonumber(s.t) + 1 }
  end }
