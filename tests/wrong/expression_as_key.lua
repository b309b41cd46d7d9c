-- expect: 5: index of type number; must be a name
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
local x = 0
for i, v in ipairs(p) do x = x + v end
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = x }
  end }
