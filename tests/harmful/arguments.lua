-- expect: 7: a function is called with more than 250 arguments for `...`; pass them in a table
-- Tries a function that copies its many arguments at every step.
local rd = require "refdyn"
local t = {}
for i = 1, 2e5 do t[i] = i end
local function copy(...)
  for i = 1, 1e6 do local a, b = ..., ... end
end
copy(table.unpack(t))
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
