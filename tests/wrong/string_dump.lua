-- expect: 6: string.dump: unknown function; models/README.md lists the functions
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = #string.dump(function() end) }
  end }
