-- expect: 6: string.lenght: unknown function; did you mean "len"?
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = #string.lenght("x") }
  end }
