-- expect: 3: stack overflow: a function calls itself endlessly; add a case in which it returns without the call
local function f(n)
  return 1 + f(n + 1)
end
return f(1)
