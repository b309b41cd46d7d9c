-- expect: 5: pairs: an expression or a group of values; must be a table
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
local x = 0
for name, v in pairs(p) do x = x + v end
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = x }
  end }
