-- expect: 6: undefined global "undefined_one"; set it before it is read
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = _G.undefined_one }
  end }
