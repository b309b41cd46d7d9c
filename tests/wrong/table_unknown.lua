-- expect: 6: table.getn: unknown function; models/README.md lists the functions
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = table.getn({ 1 }) }
  end }
