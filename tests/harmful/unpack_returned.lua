-- expect: 8: more than 100 million steps to read the model; look for a loop without an end
-- Tries to pass a long list of results through a thousand calls.
local rd = require "refdyn"
local t = {}
for i = 1, 2e5 do t[i] = i end
local function deep(n)
  if n == 0 then return table.unpack(t) end
  return 0, deep(n - 1)
end
for i = 1, 1e6 do deep(1000) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
