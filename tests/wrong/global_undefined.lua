-- expect: 6: undefined global "rfe"; set it before it is read
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = rfe * 2 }
  end }
