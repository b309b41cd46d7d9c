-- expect: 4: bad argument #1 to 'rep' (number expected, got expression)
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
local text = ("x"):rep(p.n)
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = 1 }
  end }
