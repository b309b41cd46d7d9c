-- expect: 3: bad argument #1 to 'tonumber' (string expected, got number)
local rd = require "refdyn"
local n = tonumber(12, 10)
