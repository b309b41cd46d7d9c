-- expect: 5: bad 'for' limit (number expected, got expression); its value is not known while the model is read; use an option (rd.option)
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
local x = 0
for i = 1, p.n do x = x + i end
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = x }
  end }
