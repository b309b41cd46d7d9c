-- expect: 5: attempt to perform bitwise operation on a string value (local 'a')
-- Tries to use a long text as a number.
local rd = require "refdyn"
local a, n = "0x" .. ("f"):rep(1e6), 0
for i = 1, 1e7 do n = a | 1 end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
